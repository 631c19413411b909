#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include <ensonify/engine/imitation/evidence.h>
#include <ensonify/engine/recording/recorded_line.h>
#include <ensonify/engine/sonar/instrument/receiver_options.h>

namespace ensonify::engine {

/// What the samples of a line show of its recorder, without any simulation.
struct RecorderSigns {
  double full_scale = 1.0;  ///< in the recording's numbers
  int bits = 15;
  bool clips = false;      ///< several samples are at full scale
  double ping_mean = 0.0;  ///< as ReceiverOptions::ping_mean; 0: pings are not scaled
  TransferCurve curve = TransferCurve::linear;
  double curve_range_db = 90.0;
  Detector detector = Detector::mean;
  int looks = 1;
  double burst_m = 0.0;  ///< as OtherPathsOptions::burst_m
  /// An automatic gain makes all ranges equally bright, the water column as well.
  bool even_ranges = false;
  /// The same for the mean of this many samples of each ping; 0: no such gain was found.
  std::size_t even_samples = 0;
  bool has_automatic_gain() const { return even_ranges || even_samples > 0; }
  double column_db = -60.0;  ///< rms of the water column, dB re full scale
  Evidence bits_from, ping_mean_from, curve_from, looks_from, burst_from, column_from;
};
RecorderSigns recorder_signs(const RecordedLine& line);

/// The amplitude before the transfer curve, over full scale; `share` is a sample over full scale.
double expanded(double share, const RecorderSigns& recorder);

/// Standard deviation over mean, and skewness, of what a detector makes of this number of looks
/// with Rayleigh amplitudes, and of its square root if the curve is that. If the curve is
/// logarithmic, the standard deviation in decibels instead, and the skewness of the decibels.
struct Speckle {
  double contrast, skew;
};
Speckle speckle_of(Detector detector, int looks, TransferCurve curve = TransferCurve::linear);

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
