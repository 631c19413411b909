#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include <ensonify/engine/comparison/find_bed.h>
#include <ensonify/engine/imitation/evidence.h>
#include <ensonify/engine/imitation/recorder_signs.h>

namespace ensonify::engine {

/// The mean power of one side's samples over a level bed, in dB re full scale, by cells of grazing
/// angle of 2 degrees, of pings [first, end). NaN for a cell with fewer than `enough` samples.
/// Samples that the transfer curve compressed are expanded first. The power that clipping removed
/// is restored: if Rayleigh amplitudes have the mean power s, the power after clipping is s (1 -
/// exp(-1 / s)).
constexpr double grazing_cell_deg = 2.0;
constexpr std::size_t grazing_cells = 45;
/// The angle in the middle of a cell, and the cell that contains an angle.
double grazing_cell_rad(std::size_t cell);
std::size_t grazing_cell(double grazing_rad);
using GrazingLevels = std::array<double, grazing_cells>;
GrazingLevels grazing_levels(const LineWithBed& line, Side side, const RecorderSigns& recorder,
                             std::size_t first, std::size_t end, std::size_t enough = 60);

/// grazing_levels() of all pings, for port and starboard. NaN for a side that is missing.
std::array<GrazingLevels, 2> grazing_levels_of_sides(const LineWithBed& line,
                                                     const RecorderSigns& recorder);

/// The means of both sides. Where one side is NaN, the level of the other side.
GrazingLevels mean_of_sides(const std::array<GrazingLevels, 2>& levels_db);

/// The level of the bed in a block of pings.
struct LevelAtRange {
  std::size_t block;
  double decades;  ///< log10 of the range in metres
  double level_db;
};
/// The slope of level over range. Each cell has a straight line through its levels; all lines have
/// the same slope. Blocks [first, end) are left out.
struct SharedSlope {
  double variance = 0.0, covariance = 0.0;
  double value() const { return covariance / variance; }
};
SharedSlope shared_slope(const std::vector<std::vector<LevelAtRange>>& cells, std::size_t first,
                         std::size_t end);

/// How the level of the bed at one grazing angle changes with range, in dB per factor of ten in
/// range. The range at this angle changes with the altitude. NaN if the altitude changes too
/// little, or if the bed itself changes so much that the result is uncertain.
double range_slope_db(const LineWithBed& line, const RecorderSigns& recorder);

/// The recorder's gain over range: dB per factor of ten, and whether it compensates absorption.
struct RangeLaw {
  double spreading = 30.0;
  bool absorption = true;
  Evidence from{Confidence::assumed,
                "the altitude changes too little, or the bed too much, to tell"};

  /// The gain at a range, in dB, apart from a constant.
  double gain_db(double at_m, double absorption_db_per_m) const {
    return spreading * std::log10(at_m) + (absorption ? 2.0 * absorption_db_per_m * at_m : 0.0);
  }
};
/// The gain over range of a line whose level has the slope `slope_db` (range_slope_db()). It is
/// derived from a simulated line with the gain `law` and the slope `ours_db`. If the gain
/// compensates less than spreading alone, it is assumed to have no absorption term.
RangeLaw corrected_law(const RangeLaw& law, double slope_db, double ours_db,
                       double absorption_db_per_m, double range_m);

/// How much of a bright sample is left in the pings before and after it: the mean excess of these
/// two neighbours over the mean of the block, divided by the sample's excess over this mean. A
/// sample is bright if it exceeds 4 times the mean of its block (8 pings x 16 samples) at grazing
/// angles of 8 to 20 degrees. A point of the bed stays bright for as many pings as have it in their
/// beams; noise and other causes of bright samples do not. NaN with fewer than 30 such samples.
double lasting_peaks(const LineWithBed& line);

}  // namespace ensonify::engine
