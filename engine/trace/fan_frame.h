#pragma once

#include <array>

namespace ensonify::engine {

struct RayFan;

/// The position and axes of a fan, as plain arrays for the kernels: x is along the array, y to the
/// middle of the sector, z along the pole.
struct FanFrame {
  std::array<double, 3> origin;
  std::array<double, 9> axes;  ///< array axis, middle, pole
  double handedness;           ///< of the axes: 1, or -1 if left-handed (starboard)
};
FanFrame frame_of(const RayFan& fan);

}  // namespace ensonify::engine
