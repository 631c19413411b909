#pragma once

#include <array>
#include <optional>
#include <vector>

#include <ensonify/engine/input_file.h>

namespace ensonify::engine {

enum class Side { port, starboard };

/// One-way power pattern of a uniform line array over the angle psi from its broadside plane.
struct LineArray {
  double length_m;
  double wavelength_m;

  /// In the far field, or where the array is focused: sinc^2(L sin(psi) / lambda).
  double power(double sin_psi) const;
  /// Unfocused, at a range of the array's length or more: |1/L integral of exp(i 2 pi (F u^2 - x
  /// u))|^2 over u from -1/2 to 1/2, with x = L sin(psi) / lambda and F = L^2 / (2 lambda r)
  /// (Fresnel).
  double power(double sin_psi, double range_m) const;
  /// psi of the null of that number, asin(n lambda / L); a right angle where there is none.
  double null_rad(int number) const;
};

/// A measured level of a vertical pattern.
struct VerticalLevel {
  double depression_rad;
  double level_db;  ///< one-way power below the peak
};

/// One-way power pattern over depression, of each side: measured, or the sinc^2 of an element with
/// a given -3 dB width, tilted down; a width of 0 is the same in all directions.
struct VerticalPattern {
  double beamwidth_rad = 0.8726646259971648;  ///< 50 degrees, -3 dB to -3 dB
  double tilt_rad = 0.3490658503988659;       ///< 20 degrees, of the axis below the horizontal
  InputFile file;                             ///< where the measured levels come from
  std::array<std::vector<VerticalLevel>, 2> measured;  ///< by side, depressions ascending; or none
  // A cosine over depression, in dB, as of lobes: 0 at its brightest.
  double ripple_db = 0.0;                         ///< of its darkest, below its brightest
  double ripple_period_rad = 0.3490658503988659;  ///< 20 degrees
  double ripple_dark_rad = 0.5235987755982988;    ///< 30 degrees, a depression where it is darkest
  std::optional<double> floor_db;  ///< below the peak; unset: 20 dB, none if measured
  double port_mount_rad = 0.0;     ///< turns the side's pattern, ripple and all, down
  double starboard_mount_rad = 0.0;

  /// Between measured levels linear in dB; beyond them the last.
  double power(double depression_rad, Side side) const;
};

}  // namespace ensonify::engine
