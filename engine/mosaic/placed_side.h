#pragma once

#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/mosaic/recorded_run.h>

namespace ensonify::engine {

/// The places of a line's bins on the ground, near to far, in the run's local metres.
struct PlacedSide {
  /// 2 * bins + 1 places: the edges of bin k at 2 k and 2 k + 2, and its centre at 2 k + 1.
  std::vector<Eigen::Vector2d> places_m;
  std::vector<bool> shown;  ///< by bin: whether a mosaic shows it

  bool empty() const { return places_m.empty(); }
};

/// The layers that place() needs, for one line of a ping: one value per bin each, near to far.
struct GroundLayers {
  std::vector<float> region;
  std::vector<float> x_m, y_m;  ///< only for Positions::truth
};

/// Horizontal distance to the place at the slant range `slant_m` on a level bed that is `height_m`
/// below the sonar; 0 if the slant range is less than the height.
double ground_range_m(double slant_m, double height_m);

/// Places the bins of a line; empty if the line shows no seabed and no object.
///
/// With Positions::truth a bin lies at the origin of its echo. A bin in shadow lies between the
/// bins of seabed or objects before and behind it; bins behind the last echo lie as over a level
/// bed. With Positions::navigation all bins lie abeam of the sonar, as over a level bed. Bins
/// without data and the water column are not shown.
PlacedSide place(const MosaicPing& ping, const Sonar& sonar, const Sector& sector,
                 Positions positions, const GroundLayers& layers);

}  // namespace ensonify::engine
