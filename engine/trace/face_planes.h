#pragma once

#include <cstdint>

#include <ensonify/engine/trace/fan_frame.h>

namespace ensonify::engine {

/// What find_face_planes reads and writes, as plain arrays: it is compiled as scan_kernel is.
struct FacePlanes {
  FanFrame frame;
  double sin_azimuth, cos_azimuth;
  const float* positions;      ///< x y z of each
  const std::uint32_t* faces;  ///< three positions each
  const std::uint32_t* index;  ///< which faces
  /// As in FanRuns; up to widest_vector values behind the last may be overwritten.
  double *level, *pole, *distance;
};

/// The planes of `count` faces as a fan's plane cuts them: the same bits as list_runs gives.
void find_face_planes(const FacePlanes& planes, std::int64_t count);

}  // namespace ensonify::engine
