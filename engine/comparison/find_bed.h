#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

constexpr std::size_t bed_found_early = 2;  ///< because means over 5 samples are searched

/// Patches of a bed and the gain over range make as much: what is darker by less is not known to be
/// water.
constexpr double clearly_darker_db = 3.0;

/// Where the bed begins in the pings of one side.
struct FoundBed {
  /// By ping: the first sample of the bed, set bed_found_early samples before its edge; the first
  /// recorded one if all are bed, the number of samples if the ping is silent.
  std::vector<std::size_t> first_sample;
  std::vector<std::size_t> edge;  ///< by ping: the first sample of the bed at its edge
  bool stated = false;  ///< the bed is from the stated altitudes: the samples do not show it
  /// How much darker the water column is than the bed just behind it: its brightest third, or, if
  /// one is darker by 10 dB, its darkest. NaN without a column, or if the bed is from the stated
  /// altitudes.
  double water_darker_db = std::numeric_limits<double>::quiet_NaN();
  /// Whether what lies before the line may be bed as well: it is hardly darker.
  bool doubtful() const { return water_darker_db < clearly_darker_db; }
};

/// Finds the bottom line. The bed may begin wherever 8 samples of a ping in succession are above
/// the geometric mean of the levels of water column and bed. Its edge is taken at the smaller range
/// at which the samples leave the water column, because a beam that looks away from the nadir
/// receives the nearest bed only weakly. Noise that grows with range, as a time-varied gain makes
/// it, and what may be side lobes of a sweep do not count as bed. Fish and noise make such places,
/// too. The line prefers places that continue from ping to ping, that have less echo before them,
/// and that are at the stated altitude. The stated altitude counts only if, in half of the pings,
/// it differs from the found edge by one constant offset, of any size. In pings that the line
/// leaves out, the edge is interpolated, or it is the stated altitude less that offset.
///
/// The stated altitude alone is used
/// - if the samples of most pings show no bed, or begin behind the stated altitude;
/// - if the line lies far behind the stated altitude, although the samples behind that altitude are
///   brighter, on average, than the samples before it;
/// - if the line is doubtful(), or if ranges_are_even().
FoundBed find_bed(const RecordedLine& line, Side side);

/// A line with the bed of its sides, which is found once. The line must not be changed.
class LineWithBed : public RecordedLine {
 public:
  LineWithBed() = default;
  explicit LineWithBed(RecordedLine line) : RecordedLine(std::move(line)) {
    for (const Side side : sides()) beds_[static_cast<std::size_t>(side)] = find_bed(*this, side);
  }
  /// Of a side that the line has.
  const FoundBed& bed(Side side) const { return beds_[static_cast<std::size_t>(side)]; }

 private:
  std::array<FoundBed, 2> beds_;
};

/// Fills gaps on straight lines between the known values, and beyond them with the nearest known
/// one.
void fill_gaps(std::vector<std::optional<double>>& values);

/// Whether all ranges are equally bright, on the mean of all pings. No water column is as bright as
/// the bed: the recorder has an automatic gain that evens each range, or noise hides all echoes.
bool ranges_are_even(const RecordedLine& line, Side side);
/// The same of all sides.
bool ranges_are_even(const RecordedLine& line);

}  // namespace ensonify::engine
