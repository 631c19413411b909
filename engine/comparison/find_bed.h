#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

constexpr std::size_t bed_found_early = 2;  ///< samples; half the width of the means over 5 samples

/// Patches of a bed and the gain over range can make differences of 3 dB. So samples are certainly
/// water only if they are darker than the bed by at least this.
constexpr double clearly_darker_db = 3.0;

/// Where the bed begins in the pings of one side.
struct FoundBed {
  /// By ping: the sample bed_found_early samples before the bed's edge; the first recorded sample
  /// if all samples are bed; the number of samples if the ping is silent.
  std::vector<std::size_t> first_sample;
  std::vector<std::size_t> edge;  ///< by ping: the first sample of the bed at its edge
  bool stated = false;  ///< the bed is from the stated altitudes, as the samples do not show it
  /// How much darker the water column is than the bed just behind it. The column is divided into
  /// thirds. The value is that of the brightest third; but if the darkest third is darker than the
  /// bed by more than 10 dB, it is that of the darkest third. NaN without a water column, or if the
  /// bed is from the stated altitudes.
  double water_darker_db = std::numeric_limits<double>::quiet_NaN();
  /// Whether the samples before the found bed may be bed, too, because they are not clearly darker.
  bool doubtful() const { return water_darker_db < clearly_darker_db; }
};

/// Finds the bottom line: the first sample of the bed in each ping. The bed may begin at each place
/// where 8 successive samples of a ping are above the geometric mean of the levels of water column
/// and bed. The edge is moved from this place to the smaller range at which the samples rise above
/// the water column, because a beam that looks away from the nadir receives the nearest bed only
/// weakly. Two things are not taken as bed: noise that grows with range because of a time-varied
/// gain, and possible side lobes of a sweep. Fish and noise also make places where 8 successive
/// samples are above the geometric mean. The line prefers places that continue from ping to ping,
/// that have less echo before them, and that are at the stated altitude. The stated altitude is
/// used for this only if it differs from the edges in half of the pings by one constant offset, of
/// any size. In pings that the line leaves out, the edge is the stated altitude with this offset,
/// or it is interpolated.
///
/// The stated altitude alone is used
/// - if most pings show no bed, or their samples begin behind the stated altitude;
/// - if the line lies far behind the stated altitude, but samples just behind that altitude are
///   brighter, on average, than the samples before it;
/// - if the line is doubtful(), or if ranges_are_even().
FoundBed find_bed(const RecordedLine& line, Side side);

/// A line with the beds of its sides, found once: do not change the line afterwards.
class LineWithBed : public RecordedLine {
 public:
  LineWithBed() = default;
  explicit LineWithBed(RecordedLine line) : RecordedLine(std::move(line)) {
    for (const Side side : sides()) beds_[static_cast<std::size_t>(side)] = find_bed(*this, side);
  }
  /// The bed of a side that the line has.
  const FoundBed& bed(Side side) const { return beds_[static_cast<std::size_t>(side)]; }

 private:
  std::array<FoundBed, 2> beds_;
};

/// Fills gaps between known values linearly, and gaps at the ends with the nearest known value.
void fill_gaps(std::vector<std::optional<double>>& values);

/// Whether all ranges are equally bright, on average over all pings. A water column is darker than
/// the bed, so an automatic gain evens each range, or noise hides all echoes.
bool ranges_are_even(const RecordedLine& line, Side side);
/// Whether ranges_are_even() holds for all sides of the line.
bool ranges_are_even(const RecordedLine& line);

}  // namespace ensonify::engine
