#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <ensonify/engine/sonar/instrument/sonar.h>

namespace ensonify::engine {

/// The one-way power patterns of a sonar's transmitter and receiver along the track:
/// |Shading::field()|^2, from tables over range (some per octave) and over the distance from the
/// beam's middle.
class OneWayBeams {
 public:
  enum Array : std::size_t { transmitter, receiver };

  /// For ranges up to farthest_m. Ranges below the array's length are treated as that length.
  OneWayBeams(const Sonar& sonar, double wavelength_m, double farthest_m);

  /// At a distance along the track from the beam's middle; 0 beyond the eighth null.
  double power(Array array, double range_m, double along_m) const;
  /// The distance from the middle within which nearly all of that power is: to the second null,
  /// plus half the array's length times its defocus.
  double main_m(double range_m) const;
  /// How widely the beams of two legs of these lengths overlap: the integral along the track of
  /// transmitter times receiver. It is the mean of two cases: each leg may be the way out. apart_m:
  /// distance between the middles of the beams.
  double overlap_m(double leg_m, double other_m, double apart_m = 0.0) const;
  /// The overlap if rough surfaces on the way spread the sound along the track with the standard
  /// deviation spread_m. It is right for little and for much spread; in between, beams are taken as
  /// Gaussian.
  double spread_overlap_m(double leg_m, double other_m, double apart_m, double spread_m) const;

 private:
  struct Row {
    double range_m, main_m, reach_m;
    std::array<std::vector<float>, 2> power;  // at columns + 1 even distances from 0 to reach_m
    std::array<double, 2> width_m;            // integrals of power along the track
    double at(Array array, double along_m) const;
  };
  double overlap_m(const Row& one, const Row& other, double apart_m) const;
  double place_of(double range_m) const;
  const Row& row_of(double range_m) const;

  double nearest_m_;
  std::vector<Row> rows_;
  std::vector<double> overlaps_;  // of each pair of rows, over even steps of the distance's root
};

}  // namespace ensonify::engine
