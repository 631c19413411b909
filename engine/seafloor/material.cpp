#include <ensonify/engine/seafloor/material.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/scatter/composite_roughness.h>
#include <ensonify/scatter/solid_target.h>

namespace ensonify::engine {
namespace {

using scatter::Sediment, scatter::Solid;

constexpr std::string_view solid = "solid", lambert = "lambert";

/// What covers a bed, by Lambert's law. Dense Posidonia has -23 dB, nearly the same at all angles
/// and frequencies (Lyons and Pouliquen 1998); this value gives -23 dB at 23 degrees. Shells: a
/// typical value.
struct Cover {
  std::string_view name;
  double mu_db;
};
constexpr std::array covers = {Cover{"seagrass", -15.0}, Cover{"shells", -14.0}};

Sediment parameters_of(const Material& material) {
  Sediment sediment = material.mean_grain_size_phi
                          ? scatter::sediment_of_grain_size(*material.mean_grain_size_phi)
                          : scatter::sediment_named(material.like);
  using Parameter = std::pair<std::optional<double> Material::*, double Sediment::*>;
  for (const auto& [given, parameter] :
       {Parameter{&Material::density_ratio, &Sediment::density_ratio},
        Parameter{&Material::sound_speed_ratio, &Sediment::sound_speed_ratio},
        Parameter{&Material::loss, &Sediment::loss},
        Parameter{&Material::volume, &Sediment::volume},
        Parameter{&Material::exponent, &Sediment::exponent},
        Parameter{&Material::strength_cm4, &Sediment::strength_cm4}})
    sediment.*parameter = (material.*given).value_or(sediment.*parameter);
  sediment.strength_offset_db = material.strength_offset_db;
  scatter::check(sediment);
  return sediment;
}

Solid solid_of(const Material& material) {
  Solid known = scatter::solid_named(material.like);
  known.diffuse_db = material.diffuse_db.value_or(known.diffuse_db);
  known.specular = material.specular.value_or(known.specular);
  known.lobe_width_rad = material.lobe_width_rad.value_or(known.lobe_width_rad);
  return known;
}

bool is_sediment(const Material& material) {
  return material.model != solid && scatter::bottom_model_kind(material.model).by_sediment;
}

}  // namespace

std::vector<MaterialModel> material_models() {
  std::vector<MaterialModel> models;
  for (const scatter::BottomModelKind& kind : scatter::bottom_model_kinds())
    models.push_back({kind.name, kind.help});
  models.push_back({solid, "a solid: a diffuse part and a specular lobe"});
  return models;
}

Material material_named(std::string_view name, std::span<const Material> own) {
  const auto found = std::ranges::find(own, name, &Material::name);
  if (found != own.end()) return *found;
  Material known{.name = std::string(name), .like = std::string(name)};
  const std::vector<scatter::NamedSolid> solids = scatter::named_solids();
  if (std::ranges::find(solids, name, &scatter::NamedSolid::name) != solids.end()) {
    known.model = solid;
    return known;
  }
  if (const auto cover = std::ranges::find(covers, name, &Cover::name); cover != covers.end()) {
    known.model = lambert;
    known.lambert_mu_db = cover->mu_db;
    return known;
  }
  try {
    scatter::sediment_named(name);
  } catch (const std::invalid_argument& unknown) {
    std::string solid_names;
    for (const scatter::NamedSolid& known_solid : solids)
      solid_names += fmt::format(", {}", known_solid.name);
    throw std::invalid_argument(fmt::format(
        "{}; covers are seagrass, shells; solids are{}; or describe it in a table [material.{}]",
        unknown.what(), solid_names.substr(1), name));
  }
  return known;
}

std::unique_ptr<scatter::Backscatter> backscatter_of(const Material& material, double frequency_hz,
                                                     double sound_speed_mps,
                                                     double relief_spacing_m) {
  if (material.model == lambert) return std::make_unique<scatter::Lambert>(material.lambert_mu_db);
  if (material.model == solid) return std::make_unique<scatter::SolidTarget>(solid_of(material));
  const Sediment sediment = parameters_of(material);
  const double k_per_cm =
      scatter::relief_wavenumber_per_cm(sediment, frequency_hz, sound_speed_mps);
  return std::make_unique<scatter::Bottom>(
      sediment, frequency_hz, sound_speed_mps, material.model,
      relief_spacing_m > 0.0
          ? scatter::resolved_slope_fraction(sediment, k_per_cm, relief_spacing_m)
          : 0.0);
}

std::optional<Sediment> sediment_of(const Material& material) {
  if (!is_sediment(material)) return std::nullopt;
  return parameters_of(material);
}

std::optional<double> lobe_width_rad(std::string_view name, std::span<const Material> own) {
  const auto is_its = [&](const auto& known) { return known.name == name; };
  std::optional<Solid> of_name;
  if (const auto found = std::ranges::find_if(own, is_its); found != own.end()) {
    if (found->model == solid) of_name = solid_of(*found);
  } else {
    const std::vector<scatter::NamedSolid> known = scatter::named_solids();
    if (const auto named = std::ranges::find_if(known, is_its); named != known.end())
      of_name = named->solid;
  }
  if (!of_name || !(of_name->specular > 0.0)) return std::nullopt;
  return of_name->lobe_width_rad;
}

std::optional<std::string> validity_warning(const Material& material, double frequency_hz) {
  if (!is_sediment(material)) return std::nullopt;
  const auto warning = scatter::validity_warning(parameters_of(material), frequency_hz);
  if (!warning) return std::nullopt;
  return fmt::format("material {}: {}", material.name, *warning);
}

}  // namespace ensonify::engine
