#pragma once

#include <algorithm>
#include <functional>
#include <optional>

#include <ensonify/engine/sonar/reception/sonar_equation.h>

namespace ensonify::engine {

/// The bed for all paths except the direct path: a horizontal plane.
struct LevelBed {
  /// Its backscattering cross-section, m^2 per m^2, as a function of the sine of the grazing angle.
  std::function<double(double sine)> strength;
  std::optional<scatter::Sediment> sediment;  ///< none if the bed is not a sediment

  double strength_at(double sine) const { return strength(std::clamp(sine, 1e-4, 1.0)); }
  /// The wavenumber of the sediment's relief.
  double relief_k_per_cm(const SonarEquation& law) const {
    return scatter::relief_wavenumber_per_cm(*sediment, law.frequency_hz(), law.sound_speed_mps());
  }
};

}  // namespace ensonify::engine
