#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <ensonify/engine/sonar/echo/beam.h>
#include <ensonify/engine/sonar/instrument/sonar.h>

namespace ensonify::engine {

/// What is left of the two-way beam along the track when the receiver has moved and turned since
/// transmission: the integral over the transmitter's pattern times the receiver's, which is shifted
/// by some sine, over that at rest. It counts the lobes to which rays go, as the direct echo does.
class MovedBeam {
 public:
  MovedBeam(const Sonar& sonar, double wavelength_m);

  /// By summing over the beam.
  double summed_share(double range_m, double shift) const;
  /// The same from a table: within 0.15 dB down to -10 dB.
  double share(double range_m, double shift) const;

 private:
  static constexpr std::size_t share_rows = 32, shift_steps = 32;
  struct Row {
    double steps_per_shift;  // the last step is at the shift beyond which nothing is left
    std::array<double, shift_steps + 1> shares;
  };
  double lobes_rad(const LineArray& array, double defocus, double range_m) const;

  Sonar sonar_;
  LineArray transmit_, receive_;
  Beam beam_;
  double half_way_m_;  // the range of the middle row; rows are even in r / (r + half way)
  std::vector<Row> rows_;
};

}  // namespace ensonify::engine
