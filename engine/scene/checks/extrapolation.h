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
/// whose levels may be off by more than scatter::ordinary_spread_db. Mud and sand up to medium
/// sand, from 10 kHz to 1 MHz, are within that spread.
class Extrapolation {
 public:
  Extrapolation() = default;
  /// For a simulator's sonars and materials; `own` are the materials that its scene defines.
  Extrapolation(std::span<const Sonar> sonars, std::span<const std::string> materials,
                std::span<const Material> own);
  Extrapolation& operator+=(const Extrapolation& other);

  /// A warning in one line; none where all is validated.
  std::optional<std::string> warning() const;
  /// These warnings, followed by warning().
  std::vector<std::string> appended_to(std::span<const std::string> warnings) const;

 private:
  void add(const std::string& name, double spread_db);

  std::map<std::string, double> spread_db_;  // by the material's name
  double lowest_hz_ = std::numeric_limits<double>::infinity(), highest_hz_ = 0.0;
};

}  // namespace ensonify::engine
