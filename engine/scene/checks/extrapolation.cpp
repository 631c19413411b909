#include <ensonify/engine/scene/checks/extrapolation.h>

#include <algorithm>

#include <fmt/format.h>

#include <ensonify/scatter/validity.h>

namespace ensonify::engine {

Extrapolation::Extrapolation(std::span<const Sonar> sonars, std::span<const std::string> materials,
                             std::span<const Material> own) {
  for (const Sonar& sonar : sonars)
    for (const std::string& name : materials.subspan(1)) {  // after "none"
      const Material material = material_named(name, own);
      const auto sediment = sediment_of(material);
      if (!sediment) continue;
      const double spread_db =
          scatter::expected_spread_db(*sediment, sonar.frequency_hz, material.model);
      if (!(spread_db > scatter::ordinary_spread_db)) continue;
      add(name, spread_db);
      lowest_hz_ = std::min(lowest_hz_, sonar.frequency_hz);
      highest_hz_ = std::max(highest_hz_, sonar.frequency_hz);
    }
}

void Extrapolation::add(const std::string& name, double spread_db) {
  double& largest = spread_db_[name];
  largest = std::max(largest, spread_db);
}

Extrapolation& Extrapolation::operator+=(const Extrapolation& other) {
  for (const auto& [name, spread_db] : other.spread_db_) add(name, spread_db);
  lowest_hz_ = std::min(lowest_hz_, other.lowest_hz_);
  highest_hz_ = std::max(highest_hz_, other.highest_hz_);
  return *this;
}

std::optional<std::string> Extrapolation::warning() const {
  if (spread_db_.empty()) return std::nullopt;
  constexpr std::size_t max_named = 5;
  std::string names;
  std::size_t i = 0;
  double largest_db = 0.0;
  for (const auto& [name, spread_db] : spread_db_) {
    largest_db = std::max(largest_db, spread_db);
    if (i++ < max_named) names += (names.empty() ? "" : ", ") + name;
  }
  if (spread_db_.size() > max_named)
    names += fmt::format(" and {} more", spread_db_.size() - max_named);
  const std::string used =
      lowest_hz_ < highest_hz_
          ? fmt::format("{:g} to {:g}", lowest_hz_ / 1000.0, highest_hz_ / 1000.0)
          : fmt::format("{:g}", lowest_hz_ / 1000.0);
  return fmt::format(
      "levels are extrapolated, {}: the bottom model is validated from {:g} to {:g} kHz, and used "
      "at {} kHz for {}",
      scatter::spread_text(largest_db), scatter::lowest_valid_hz / 1000.0,
      scatter::highest_valid_hz / 1000.0, used, names);
}

std::vector<std::string> Extrapolation::appended_to(std::span<const std::string> warnings) const {
  std::vector<std::string> all(warnings.begin(), warnings.end());
  if (const auto its_own = warning()) all.push_back(*its_own);
  return all;
}

}  // namespace ensonify::engine
