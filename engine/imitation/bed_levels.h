#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include <ensonify/engine/comparison/find_bed.h>
#include <ensonify/engine/imitation/evidence.h>
#include <ensonify/engine/imitation/recorder_signs.h>

namespace ensonify::engine {

/// Mean power over full scale, dB, by cells of grazing angle (2 degrees each) over a level bed, of
/// one side; NaN where fewer than `enough` samples are. Samples that the transfer curve compressed
/// are expanded first. The power that clipping removed is restored for Rayleigh amplitudes, of
/// which a mean power s keeps s (1 - exp(-1 / s)) below full scale.
constexpr double grazing_cell_deg = 2.0;
constexpr std::size_t grazing_cells = 45;
/// The angle in the middle of a cell, and the cell of an angle.
double grazing_cell_rad(std::size_t cell);
std::size_t grazing_cell(double grazing_rad);
using GrazingLevels = std::array<double, grazing_cells>;
GrazingLevels grazing_levels(const LineWithBed& line, Side side, const RecorderSigns& recorder,
                             std::size_t first, std::size_t end, std::size_t enough = 60);

/// grazing_levels() of all pings, port and starboard; NaN for a side that is missing.
std::array<GrazingLevels, 2> grazing_levels_of_sides(const LineWithBed& line,
                                                     const RecorderSigns& recorder);

/// The means of the sides; of one side alone where the other is NaN.
GrazingLevels mean_of_sides(const std::array<GrazingLevels, 2>& levels_db);

/// The level of the bed in a block of pings.
struct LevelAtRange {
  std::size_t block;
  double decades;  ///< of the range in metres
  double level_db;
};
/// The slope of the straight lines through the levels of each cell, which share it, without the
/// blocks [first, end).
struct SharedSlope {
  double variance = 0.0, covariance = 0.0;
  double value() const { return covariance / variance; }
};
SharedSlope shared_slope(const std::vector<std::vector<LevelAtRange>>& cells, std::size_t first,
                         std::size_t end);

/// How the level of the bed at one grazing angle changes with range, dB per factor of ten in range.
/// The range at that angle changes with the altitude: NaN if the altitude changes too little, or if
/// the bed changes so much that the result is uncertain.
double range_slope_db(const LineWithBed& line, const RecorderSigns& recorder);

/// The recorder's gain over range.
struct RangeLaw {
  double spreading = 30.0;
  bool absorption = true;
  Evidence from{Confidence::assumed,
                "the altitude changes too little, or the bed too much, to tell"};

  /// What it amplifies at a range, apart from a constant.
  double gain_db(double at_m, double absorption_db_per_m) const {
    return spreading * std::log10(at_m) + (absorption ? 2.0 * absorption_db_per_m * at_m : 0.0);
  }
};
/// The gain over range of a line with this slope, from a simulated line with the gain `law` and the
/// slope `ours_db`. A gain that compensates less than spreading alone is taken to have no
/// absorption term.
RangeLaw corrected_law(const RangeLaw& law, double slope_db, double ours_db,
                       double absorption_db_per_m, double range_m);

/// How much of a bright sample is left in the pings before and after it: the mean of the
/// neighbours' excess over the mean of their block, over the sample's own excess. Bright is what
/// exceeds 4 times the mean of its block (8 pings x 16 samples) at 8 to 20 degrees of grazing
/// angle. A point of the bed lasts for as many pings as have it in their beams; noise and other
/// causes of single bright samples do not. NaN with fewer than 30 such samples.
double lasting_peaks(const LineWithBed& line);

}  // namespace ensonify::engine
