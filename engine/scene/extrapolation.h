#pragma once

#include <limits>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/seafloor/material.h>
#include <ensonify/engine/sonar/instrument/sonar.h>

namespace ensonify::engine {

/// Which sediments are used at frequencies for which the bottom model is not validated.
class Extrapolation {
 public:
  Extrapolation() = default;
  /// Of a simulator's sonars and materials; `own` are the materials that its scene defines.
  Extrapolation(std::span<const Sonar> sonars, std::span<const std::string> materials,
                std::span<const Material> own);
  Extrapolation& operator+=(const Extrapolation& other);

  /// A warning in one line; none where all is validated.
  std::optional<std::string> warning() const;
  /// These warnings, followed by warning().
  std::vector<std::string> behind(std::span<const std::string> warnings) const;

 private:
  std::set<std::string> materials_;
  double lowest_hz_ = std::numeric_limits<double>::infinity(), highest_hz_ = 0.0;
};

}  // namespace ensonify::engine
