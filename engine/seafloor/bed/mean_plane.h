#pragma once

#include <span>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::engine {

/// The plane to which a generated bed adds its relief.
struct MeanPlane {
  double depth_m;  ///< of the plane's middle
  double slope_rad;
  double downhill_rad;  ///< heading down the slope, clockwise from north

  /// The rise of the plane per metre to the east and per metre to the north.
  Eigen::Vector2d rise() const;
};

/// Sets z_m, the heights of a grid's points row by row, to the heights of the plane.
void lay(const MeanPlane& plane, const Heightfield& grid, std::span<double> z_m);

}  // namespace ensonify::engine
