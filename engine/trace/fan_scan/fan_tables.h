#pragma once

#include <cstdint>
#include <memory>

#include <ensonify/engine/simd/cache_lines.h>
#include <ensonify/engine/trace/ray_fan.h>

namespace ensonify::engine {

/// A grid's tables as fan_scan looks things up in them.
///
/// Directions of one plane, x along it and y towards the pole, are ordered by q = y / (x + |y|),
/// which grows with their elevation from -1 at -90 degrees to 1 at 90. How many of a grid's
/// elevations are below a q is guessed by lines over even steps of q, and then found by looking at
/// q itself.
class FanTables {
 public:
  /// Keeps the grid. Throws std::invalid_argument for elevations that do not ascend, or beyond 90
  /// degrees from the middle.
  void take(std::shared_ptr<const FanGrid> grid);
  const FanGrid* grid() const { return grid_.get(); }

  static constexpr std::int64_t steps = 2048;

  CacheLines<double> sin_azimuth, cos_azimuth;  ///< by plane
  CacheLines<float> tan_azimuth;
  /// By plane: rays [from, until) are outside the beam, and no others unless it is uneven.
  CacheLines<std::int64_t> left_out_from, left_out_until;
  CacheLines<std::uint8_t> uneven;
  CacheLines<float> sin_elevation, cos_elevation;  ///< with room behind them for a vector's width
  CacheLines<double> ascending;                    ///< -2, q of each elevation, 2
  /// By step of q, as floats: how many elevations are below its start, plus a half to round by, and
  /// in the upper half how many more below its end. Rounded down that is at most one too few; where
  /// it may not be, the first is negative.
  CacheLines<std::uint64_t> lines;
  double first = 0.0;  ///< q of step 0
  double steps_per_q = 0.0;

 private:
  void lay_lines(double span);

  std::shared_ptr<const FanGrid> grid_;
};

}  // namespace ensonify::engine
