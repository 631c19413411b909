#pragma once

#include <array>
#include <cmath>
#include <numbers>

namespace ensonify::engine {

/// Weights of four neighbouring points for a place at t in [0, 1] between the second and the third
/// (Catmull and Rom 1974). The interpolant passes through the points and has continuous slopes.
inline std::array<double, 4> catmull_rom(double t) {
  const double t2 = t * t, t3 = t2 * t;
  return {0.5 * (2.0 * t2 - t3 - t), 0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
          0.5 * (4.0 * t2 - 3.0 * t3 + t), 0.5 * (t3 - t2)};
}

/// Interpolation of independent numbers along two axes keeps their variance if the result is
/// multiplied by this, because the mean of the sum of squared weights is 57 / 70 for each axis.
inline constexpr double catmull_rom_keeps_variance = 70.0 / 57.0;

/// The factor by which this interpolation changes the amplitude of a wave with a phase step of
/// `rad_per_point` between points (Keys 1981, the kernel's transform for a = -1/2).
inline double catmull_rom_response(double rad_per_point) {
  const double f = 0.5 * rad_per_point / std::numbers::pi;  // waves per point
  if (std::abs(f) < 1e-2) return 1.0;                       // within 1e-6
  const auto sinc = [](double x) {
    return x == 0.0 ? 1.0 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x);
  };
  const double s1 = sinc(f), s2 = sinc(2.0 * f), s4 = sinc(4.0 * f);
  return (3.0 * (s1 * s1 - s2) - (3.0 * s2 * s2 - 2.0 * s2 - s4)) /
         (std::numbers::pi * f * std::numbers::pi * f);
}

}  // namespace ensonify::engine
