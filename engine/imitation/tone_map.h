#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <ensonify/engine/imitation/bed_levels.h>
#include <ensonify/engine/imitation/vehicle_path.h>

namespace ensonify::engine {

/// Where the bed is brighter or darker than the line's mean at the same grazing angle and side, as
/// pixels over a seabed about the middle of the path, north up.
struct ToneMap {
  static constexpr double step_db = 2.0;
  static constexpr int max_steps = 6;  ///< either way
  std::size_t columns = 0, rows = 0;
  std::vector<std::int8_t> steps;  ///< by pixel, from the north-west; empty: a single tone
};

/// Something bright on the bed that is no tone of it, where it is brightest.
struct BrightObject {
  std::size_t ping;  ///< index in the line
  Side side;
  double range_m, over_bed_db;
};
/// The objects that tone_map() leaves out, the brightest first: blocks of the bed (8 pings x 16
/// samples) that are 6 dB brighter than the median of the 49 around. None if more than a fiftieth
/// of the blocks differ so much.
std::vector<BrightObject> bright_objects(const LineWithBed& line, const VehiclePath& path,
                                         const RecorderSigns& recorder);

/// From some pings of a line and their path; tiles between them are filled from their neighbours.
/// The level changes that the altitude causes through the gain over range (range_slope_db()) are
/// removed. Single bright objects and
/// their shadows are left out. There is a single tone if fewer than a twentieth of the tiles differ
/// by 2 dB from the mean.
ToneMap tone_map(const LineWithBed& line, const VehiclePath& path, const RecorderSigns& recorder,
                 double range_slope_db, double extent_east_m, double extent_north_m);

}  // namespace ensonify::engine
