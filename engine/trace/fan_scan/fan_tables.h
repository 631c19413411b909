#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <ensonify/engine/simd/cache_lines.h>
#include <ensonify/engine/trace/fan_scan/elevation_order.h>
#include <ensonify/engine/trace/ray_fan.h>

namespace ensonify::engine {

/// A grid's lookup tables for fan_scan.
///
/// Directions of one plane, x along it and y towards the pole, are ordered by q = y / (x + |y|),
/// which grows with elevation from -1 at -90 degrees to 1 at 90. The number of a grid's elevations
/// below a given q is guessed by a line for each step of q, and then corrected by comparing q.
class FanTables {
 public:
  /// Keeps the grid. Throws std::invalid_argument for elevations that do not ascend, or are more
  /// than 90 degrees from the middle.
  void take(std::shared_ptr<const FanGrid> grid);
  const FanGrid* grid() const { return grid_.get(); }
  ElevationOrder order() const {
    return {ascending.data(), lines.data(), first, steps_per_q, static_cast<double>(steps)};
  }

  static constexpr std::int64_t steps = 2048;

  CacheLines<double> sin_azimuth, cos_azimuth;  ///< by plane
  CacheLines<float> tan_azimuth;
  /// By plane: rays [from, until) are outside the beam, and no others unless `uneven` is set.
  CacheLines<std::int64_t> left_out_from, left_out_until;
  CacheLines<std::uint8_t> uneven;
  CacheLines<float> sin_elevation, cos_elevation;  ///< with padding of one vector
  CacheLines<double> ascending;                    ///< -2, q of each elevation, 2
  /// By step of q, as two floats: the number of elevations below its start, plus 0.5 for rounding,
  /// and in the upper half how many more are below its end. Rounded down, the guess is at most one
  /// too low; where it may be further off, the first float is negative.
  CacheLines<std::uint64_t> lines;
  double first = 0.0;  ///< q of step 0
  double steps_per_q = 0.0;

 private:
  void lay_lines(double span);

  std::shared_ptr<const FanGrid> grid_;
};

/// The tables of the grids that were used last: the sides of a sonar that rolls alternate between a
/// few grids.
class KnownFanTables {
 public:
  /// Returns the tables of a grid. If they are not kept, makes them as FanTables::take() does.
  /// Valid until the next call.
  const FanTables& of(const std::shared_ptr<const FanGrid>& grid);

 private:
  std::vector<std::unique_ptr<FanTables>> known_;  // the one used last is first
};

}  // namespace ensonify::engine
