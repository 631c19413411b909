#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/comparison/find_bed.h>

namespace ensonify::engine {

/// The curve to which a statistic belongs.
enum class StatisticCurve { none, level_over_grazing, level_over_range, contrast_over_grazing };

/// The part of a curve for a statistic: degrees of grazing angle, or percent of the range.
struct CurvePart {
  StatisticCurve curve = StatisticCurve::none;
  int low = 0, high = 0;
};

/// One number that describes how a line looks.
struct LineStatistic {
  std::string name;  ///< with the unit
  double value;      ///< NaN: it cannot be computed for the line
  CurvePart part;
  bool of_path = false;  ///< it describes the path of the vehicle, not the echoes
};

/// The statistics of pings [first, end) of a line, always with the same names in the same order.
/// doc/statistics.md defines each for users. They do not depend on the recorder's scale. A row is
/// one side of a ping; all rows must have one range and length (alike_pings()). Amplitudes are as
/// recorded; levels are 20 log10 of amplitudes.
///
/// find_bed() gives the first sample of the bed in each row. Grazing angles are computed for a
/// level bed: asin(range of the first return / range). Blocks are 8 pings x 16 samples of the bed.
/// Correlations are between samples of one block, about the mean of the block. Medians over blocks
/// are robust against objects and shadows. A change of tone is the change of level between blocks
/// at the same range. Its statistic is the standard deviation of the normal distribution with the
/// same median square; speckle alone gives 0.54 dB.
///
/// `stop_check` is called before each side; it may throw to end the work.
std::vector<LineStatistic> line_statistics(const LineWithBed& line, std::size_t first,
                                           std::size_t end,
                                           const std::function<void()>& stop_check = {});

/// A statistic of two lines A and B, and its spread within line A.
struct ComparedStatistic {
  std::string name;
  double a, b;
  double spread;  ///< difference between two halves of A's pings: halves_at_equal_altitude(), or,
                  ///< for a statistic of the path, the first and the second half
  CurvePart part;
  /// |b - a| divided by the spread. It is 0 if the rounding of a file explains the difference,
  /// infinite if the spread is 0 but the difference is not, and NaN if a number is unknown.
  double ratio() const;
};
/// Divides the pings of a line into two halves, and returns their indices. If the altitudes of the
/// first and the second half differ by at most a twentieth, these are the halves. If they differ by
/// more, level and texture at each range differ because of the altitude, and the spread between
/// these halves would be too large. Then blocks of about 32 pings are ordered by altitude. Of each
/// two blocks in this order, the earlier block is in one half and the later block in the other
/// half.
std::array<std::vector<std::size_t>, 2> halves_at_equal_altitude(const LineWithBed& line);

/// The statistics of two lines. `stop_check` as in line_statistics().
std::vector<ComparedStatistic> compare_lines(const LineWithBed& a, const LineWithBed& b,
                                             const std::function<void()>& stop_check = {});

/// How alike two lines are.
struct Likeness {
  std::size_t within = 0, known = 0;  ///< number of ratios of at most 1, and of all known ratios
  /// Root mean squares of the differences along the curves, dB; the difference of contrasts is 20
  /// log10 of their ratio. NaN if no difference is known.
  double level_over_grazing_db, level_over_range_db, contrast_db;
  std::string decibels() const;  ///< these differences as a text
};
Likeness likeness(std::span<const ComparedStatistic> statistics);

}  // namespace ensonify::engine
