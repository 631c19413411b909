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

/// The part of a curve that a statistic describes: degrees of grazing angle, or percent of the
/// range.
struct CurvePart {
  StatisticCurve curve = StatisticCurve::none;
  int low = 0, high = 0;
};

/// One number that describes how a line looks.
struct LineStatistic {
  std::string name;  ///< with its unit
  double value;      ///< NaN: the line has no such value
  CurvePart part;
  bool of_path = false;  ///< it describes where the vehicle goes, not what the sonar receives
};

/// The statistics of pings [first, end) of a line, always the same names in the same order;
/// doc/statistics.md defines each for users. They
/// do not depend on the recorder's scale. A row is one side of a ping; all are of one range and
/// length (alike_pings()). Amplitudes are as recorded; levels are 20 log10 of them.
///
/// The bed begins, in each ping of each side, where find_bed() has it. Grazing angles are those of
/// a level bed there: asin(range of the first return / range). Blocks are 8 pings x 16 samples of
/// the bed; the local mean of a sample is that of its block, and a correlation is between samples
/// of one block, about its mean. Medians over blocks are robust against objects and shadows. A
/// change of tone is between the levels of blocks at the same range, as the standard deviation of a
/// normal distribution with the same median square; speckle alone gives 0.54 dB.
///
/// `stop_check` is called before each side; what it throws ends the work.
std::vector<LineStatistic> line_statistics(const LineWithBed& line, std::size_t first,
                                           std::size_t end,
                                           const std::function<void()>& stop_check = {});

/// A statistic of two lines, and the spread of the first one.
struct ComparedStatistic {
  std::string name;
  double a, b;
  double spread;  ///< between the halves of A's pings: halves_at_equal_altitude(), or, of a
                  ///< statistic of the path, the first and the second half
  CurvePart part;
  /// |b - a| over the spread; 0 if a file's rounding explains the difference, infinite if only the
  /// spread is 0, NaN if a number is unknown.
  double ratio() const;
};
/// The pings of a line in two halves: the first and the second, unless their altitudes differ by
/// more than a twentieth. The level and the texture at each range change with the altitude, so that
/// halves at two altitudes would excuse nearly any difference. In that case blocks of some 32 pings
/// are ordered by their altitude, and of each two in succession the earlier ping's is in the first
/// half.
std::array<std::vector<std::size_t>, 2> halves_at_equal_altitude(const LineWithBed& line);

/// `stop_check` as in line_statistics().
std::vector<ComparedStatistic> compare_lines(const LineWithBed& a, const LineWithBed& b,
                                             const std::function<void()>& stop_check = {});

/// How alike two lines are.
struct Likeness {
  std::size_t within = 0, known = 0;  ///< statistics whose ratio is 1 or less, and all known ones
  /// Root mean squares of the differences along the curves, of the contrast as 20 log10 of the
  /// ratio, dB; NaN if nothing is known.
  double level_over_grazing_db, level_over_range_db, contrast_db;
  std::string decibels() const;  ///< the differences in words
};
Likeness likeness(std::span<const ComparedStatistic> statistics);

}  // namespace ensonify::engine
