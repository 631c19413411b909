#include <ensonify/engine/scene/extrapolation.h>

#include <algorithm>

#include <fmt/format.h>

#include <ensonify/scatter/validity.h>

namespace ensonify::engine {

Extrapolation::Extrapolation(std::span<const Sonar> sonars, std::span<const std::string> materials,
                             std::span<const Material> own) {
  for (const Sonar& sonar : sonars) {
    const double hz = sonar.frequency_hz;
    if (hz >= scatter::lowest_valid_hz && hz <= scatter::highest_valid_hz) continue;
    for (const std::string& name : materials.subspan(1)) {  // after "none"
      if (!sediment_of(material_named(name, own))) continue;
      materials_.insert(name);
      lowest_hz_ = std::min(lowest_hz_, hz);
      highest_hz_ = std::max(highest_hz_, hz);
    }
  }
}

Extrapolation& Extrapolation::operator+=(const Extrapolation& other) {
  materials_.insert(other.materials_.begin(), other.materials_.end());
  lowest_hz_ = std::min(lowest_hz_, other.lowest_hz_);
  highest_hz_ = std::max(highest_hz_, other.highest_hz_);
  return *this;
}

std::optional<std::string> Extrapolation::warning() const {
  if (materials_.empty()) return std::nullopt;
  constexpr std::size_t max_named = 5;
  std::string names;
  std::size_t i = 0;
  for (const std::string& name : materials_)
    if (i++ < max_named) names += (names.empty() ? "" : ", ") + name;
  if (materials_.size() > max_named)
    names += fmt::format(" and {} more", materials_.size() - max_named);
  const std::string used =
      lowest_hz_ < highest_hz_
          ? fmt::format("{:g} to {:g}", lowest_hz_ / 1000.0, highest_hz_ / 1000.0)
          : fmt::format("{:g}", lowest_hz_ / 1000.0);
  return fmt::format(
      "levels are extrapolated: the bottom model is validated from {:g} to {:g} kHz, and used at "
      "{} "
      "kHz for {}",
      scatter::lowest_valid_hz / 1000.0, scatter::highest_valid_hz / 1000.0, used, names);
}

std::vector<std::string> Extrapolation::behind(std::span<const std::string> warnings) const {
  std::vector<std::string> all(warnings.begin(), warnings.end());
  if (const auto its_own = warning()) all.push_back(*its_own);
  return all;
}

}  // namespace ensonify::engine
