#pragma once

#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/mosaic/recorded_run.h>

namespace ensonify::engine {

/// Where the bins of one line of a ping lie on the ground, near to far, in the run's local metres.
struct PlacedSide {
  /// 2 * bins + 1 places: those of the edges of bin k are 2 k and 2 k + 2, that of its centre is
  /// 2 k + 1.
  std::vector<Eigen::Vector2d> places_m;
  std::vector<bool> shown;  ///< by bin, whether it belongs to a mosaic

  bool empty() const { return places_m.empty(); }
};

/// The layers that place() needs, of one line of a ping: `bins` values each, near to far.
struct GroundLayers {
  std::vector<float> region;
  std::vector<float> x_m, y_m;  ///< only for Positions::truth
};

/// Distance over a level bed `height_m` below the sonar; 0 for a slant range that does not reach
/// it.
double ground_range_m(double slant_m, double height_m);

/// Places the bins of a line; empty if it recorded no seabed and no object.
///
/// With Positions::truth a bin lies where its echo came from. Shadow lies between the seabed or
/// objects before and behind it. Behind the last echo it continues as over a level bed. With
/// Positions::navigation all bins lie abeam of the sonar, as over a level bed. Bins without data
/// and the water column are not shown.
PlacedSide place(const MosaicPing& ping, const Sonar& sonar, const Sector& sector,
                 Positions positions, const GroundLayers& layers);

}  // namespace ensonify::engine
