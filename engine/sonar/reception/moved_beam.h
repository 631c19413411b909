#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <ensonify/engine/sonar/echo/beam.h>

namespace ensonify::engine {

/// The share of the two-way beam along the track that is left when the receiver has moved and
/// turned since transmission: the integral of the transmitter's pattern times the receiver's
/// pattern, which is shifted by a sine, divided by this integral without a shift. Only lobes that
/// have rays count, as in the direct echo.
class MovedBeam {
 public:
  MovedBeam(const Sonar& sonar, double wavelength_m);

  /// The beam that lies ahead_m ahead of the array's middle, with equal power in all directions
  /// abeam.
  Beam beam(double ahead_m) const;
  /// The share, by summing over such a beam; relative to the middle beam at rest.
  double summed_share(double range_m, double shift, const Beam& beam, double ahead_m) const;
  double summed_share(double range_m, double shift) const {
    return summed_share(range_m, shift, middle_, 0.0);
  }
  /// The share from a table: within 0.15 dB down to -10 dB.
  double share(double range_m, double shift) const;

 private:
  static constexpr std::size_t share_rows = 32, shift_steps = 48;
  struct Row {
    double steps_per_shift;  // the last step is the shift beyond which nothing is left
    std::array<double, shift_steps + 1> shares;
  };
  double lobes_rad(const LineArray& array, double defocus, double range_m) const;

  Sonar sonar_;
  LineArray transmit_, receive_;
  double wavelength_m_;
  Beam middle_;
  double half_way_m_;  // range r of the middle row; rows are at equal steps of r / (r + half way)
  std::vector<Row> rows_;
};

}  // namespace ensonify::engine
