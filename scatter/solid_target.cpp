#include <ensonify/scatter/solid_target.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/scatter/angle.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::scatter {

using std::numbers::pi;

std::vector<NamedSolid> named_solids() {
  return {{"steel", {-30.0, 0.50, 0.0}},
          {"fouled steel", {-11.0, 0.50, 15.0 * degree}},
          {"aluminium", {-30.0, 0.50, 0.0}},
          {"concrete", {-13.0, 0.25, 10.0 * degree}},
          {"stone", {-12.0, 0.30, 15.0 * degree}},
          {"wood", {-20.0, 0.03, 10.0 * degree}},
          {"glass fibre", {-18.0, 0.15, 0.0}},
          {"rubber", {-27.0, 0.005, 10.0 * degree}},
          {"fouled rubber", {-13.0, 0.005, 15.0 * degree}}};
}

std::string solid_names() {
  std::string names;
  for (const NamedSolid& known : named_solids())
    names += fmt::format("{}{}", names.empty() ? "" : ", ", known.name);
  return names;
}

Solid solid_named(std::string_view name) {
  const std::vector<NamedSolid> all = named_solids();
  const auto found = std::ranges::find(all, name, &NamedSolid::name);
  if (found != all.end()) return found->solid;
  throw std::invalid_argument(
      fmt::format("solid '{}' is not known, expected {}", name.substr(0, 64), solid_names()));
}

double Solid::smooth_specular() const {
  const double phase = 2.0 * pi * std::tan(lobe_width_rad);
  return specular * std::exp(-phase * phase);
}

Solid Solid::rough() const {
  Solid rest = *this;
  rest.specular -= smooth_specular();
  return rest;
}

SolidTarget::SolidTarget(const Solid& solid)
    : mu_(from_db(solid.diffuse_db)),
      specular_(solid.specular),
      s2_(std::pow(std::tan(solid.lobe_width_rad), 2.0)) {
  if (!(specular_ >= 0.0 && specular_ <= 1.0))
    throw std::invalid_argument(fmt::format("solid: specular is {}, expected 0 to 1", specular_));
  if (!(solid.lobe_width_rad >= 0.0 && solid.lobe_width_rad <= 45.0 * degree))
    throw std::invalid_argument(fmt::format(
        "solid: the lobe's width is {} degrees, expected 0 to 45", solid.lobe_width_rad / degree));
  constexpr double faint = 1e-9;  // the diffuse part of a mirror, whose diffuse_db is -100
  if (!(pi * mu_ + specular_ <= 1.0 + faint))
    throw std::invalid_argument(
        fmt::format("solid: diffuse_db = {} and specular = {} scatter more energy than arrives: pi "
                    "10^(diffuse_db/10) + specular is {:.3f}, expected at most 1",
                    solid.diffuse_db, specular_, pi * mu_ + specular_));
}

double SolidTarget::cross_section(double grazing_rad) const {
  const double sine = std::sin(grazing_rad);
  const double sine2 = sine * sine;
  if (sine2 < 1e-12 || !(s2_ > 0.0)) return mu_ * sine2;  // without a lobe, or nearly
  const double tan2 = (1.0 - sine2) / sine2;              // of the angle from the normal
  const double lobe = std::exp(-tan2 / s2_) / (4.0 * pi * s2_ * sine2 * sine2);
  return mu_ * sine2 + specular_ * lobe;
}

}  // namespace ensonify::scatter
