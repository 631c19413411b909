#pragma once

#include <array>
#include <cstddef>

#include <ensonify/engine/imitation/evidence.h>
#include <ensonify/engine/imitation/recorder_signs.h>
#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// Mean power over full scale, dB, by cells of grazing angle (2 degrees each) over a level bed, of
/// one side; NaN where fewer than `enough` samples are. Samples that the transfer curve compressed
/// are expanded first. The power that clipping removed is restored for Rayleigh amplitudes, of
/// which a mean power s keeps s (1 - exp(-1 / s)) below full scale.
constexpr double grazing_cell_deg = 2.0;
constexpr std::size_t grazing_cells = 45;
/// The angle in the middle of a cell.
double grazing_cell_rad(std::size_t cell);
using GrazingLevels = std::array<double, grazing_cells>;
GrazingLevels grazing_levels(const RecordedLine& line, Side side, const RecorderSigns& recorder,
                             std::size_t first, std::size_t end, std::size_t enough = 60);

/// grazing_levels() of all pings, port and starboard; NaN for a side that is missing.
std::array<GrazingLevels, 2> grazing_levels_of_sides(const RecordedLine& line,
                                                     const RecorderSigns& recorder);

/// How the level of the bed at one grazing angle changes with range, dB per factor of ten in range.
/// The range at that angle changes with the altitude: NaN if the altitude changes too little, or if
/// the bed changes so much that the result is uncertain.
double range_slope_db(const RecordedLine& line, const RecorderSigns& recorder);

/// The recorder's gain over range.
struct RangeLaw {
  double spreading = 30.0;
  bool absorption = true;
  Evidence from{Confidence::assumed,
                "the altitude changes too little, or the bed too much, to tell"};
};
/// The gain over range of a line with this slope, from a simulated line with the gain `law` and the
/// slope `ours_db`. A gain that compensates less than spreading alone is taken to have no
/// absorption term.
RangeLaw corrected_law(const RangeLaw& law, double slope_db, double ours_db,
                       double absorption_db_per_m, double range_m);

}  // namespace ensonify::engine
