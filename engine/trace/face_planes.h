#pragma once

#include <cstdint>

#include <ensonify/engine/trace/fan_frame.h>

namespace ensonify::engine {

/// What find_face_planes reads and writes, as plain arrays: it is compiled as fan_kernel is.
struct FacePlanes {
  FanFrame frame;
  double sin_azimuth, cos_azimuth;
  const float* positions;      ///< x y z of each
  const std::uint32_t* faces;  ///< three of each
  const std::uint32_t* index;  ///< the faces that are wanted
  double *level, *pole,
      *distance;  ///< as FanRuns has them; up to widest_vector behind may be overwritten
};

/// The planes of so many faces as a fan's plane cuts them: to the last bit those that list_runs
/// tells.
void find_face_planes(const FacePlanes& planes, std::int64_t count);

}  // namespace ensonify::engine
