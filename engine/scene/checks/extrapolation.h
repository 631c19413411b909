#pragma once

#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/seafloor/material.h>
#include <ensonify/engine/sonar/instrument/sonar.h>

namespace ensonify::engine {

/// The sediments that are used at frequencies for which the bottom model is not validated, and
/// whose levels may be wrong by more than scatter::ordinary_spread_db. Sediments from mud to medium
/// sand, from 10 kHz to 1 MHz, are within this spread.
class Extrapolation {
 public:
  Extrapolation() = default;
  /// For the sonars and materials of a simulator; `own` are the materials that its scene defines.
  Extrapolation(std::span<const Sonar> sonars, std::span<const std::string> materials,
                std::span<const Material> own);
  Extrapolation& operator+=(const Extrapolation& other);

  /// A warning on one line; none if all levels are within the spread.
  std::optional<std::string> warning() const;
  /// These warnings, followed by warning().
  std::vector<std::string> appended_to(std::span<const std::string> warnings) const;

 private:
  void add(const std::string& name, double spread_db);

  std::map<std::string, double> spread_db_;  // by the name of the material
  double lowest_hz_ = std::numeric_limits<double>::infinity(), highest_hz_ = 0.0;
};

}  // namespace ensonify::engine
