#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <ensonify/engine/imitation/bed_levels.h>
#include <ensonify/engine/imitation/vehicle_path.h>

namespace ensonify::engine {

/// Where the bed is brighter or darker than the line's mean at the same grazing angle and side. The
/// pixels cover a seabed about the middle of the path, with north up.
struct ToneMap {
  static constexpr double step_db = 2.0;
  static constexpr int max_steps = 6;  ///< to brighter and to darker
  std::size_t columns = 0, rows = 0;
  std::vector<std::int8_t> steps;  ///< by pixel, from the north-west; empty: a single tone
};

/// A single bright object on the bed, at its brightest place.
struct BrightObject {
  std::size_t ping;  ///< index in the line
  Side side;
  double range_m, over_bed_db;
};
/// The objects that tone_map() leaves out, the brightest first: blocks of the bed (8 pings x 16
/// samples) that are 6 dB brighter than the median of the 49 blocks around them. None if more than
/// 1 in 50 blocks differs by so much.
std::vector<BrightObject> bright_objects(const LineWithBed& line, const VehiclePath& path,
                                         const RecorderSigns& recorder);

/// Makes the map from some pings of a line and their path. Tiles between the pings are filled from
/// their neighbours. When the altitude changes, the gain over range changes the level; this part
/// (range_slope_db()) is removed. Single bright objects and their shadows are left out. There is a
/// single tone if fewer than 1 in 20 tiles differ from the mean by 2 dB.
ToneMap tone_map(const LineWithBed& line, const VehiclePath& path, const RecorderSigns& recorder,
                 double range_slope_db, double extent_east_m, double extent_north_m);

}  // namespace ensonify::engine
