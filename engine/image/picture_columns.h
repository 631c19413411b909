#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/image/line_layout.h>
#include <ensonify/engine/image/waterfall.h>

namespace ensonify::engine {

/// How the columns of a picture lie: equally spaced in slant range or in ground range.
struct PictureColumns {
  bool over_ground;
  std::size_t per_side;  ///< as many as bins, or fewer

  LineLayout layout(const Sonar& sonar) const { return {sonar.sides, per_side}; }

  friend bool operator==(const PictureColumns&, const PictureColumns&) = default;
};

/// The columns of the waterfall itself: one per bin.
PictureColumns columns_of_bins(const Sonar& sonar);

/// Those that a display asks for. row_spacing_m: how far rows are usually apart along the track, as
/// in Calibration.
PictureColumns picture_columns(const Sonar& sonar, const Display& display, double row_spacing_m);

/// The sonar's height above the bed, as if the bed were level below it: from the ping's record, or
/// else the slant range of the first echo.
double height_over_bed_m(const Waterfall& waterfall, std::size_t row);

/// What a column of a picture shows: the waterfall's columns from `from` to `until`, of the first
/// and the last perhaps a part; nothing if both are equal.
struct ShownColumns {
  double from, until;

  std::size_t first() const { return static_cast<std::size_t>(from); }
  std::size_t end() const;
  /// The one in the middle, if anything is shown.
  std::size_t middle() const { return static_cast<std::size_t>(0.5 * (from + until)); }
};

/// For each column of a picture's row.
std::vector<ShownColumns> shown_columns(const Waterfall& waterfall, std::size_t row,
                                        PictureColumns columns);

/// The mean of at(column) over what a column of a picture shows; 0 for nothing.
template <class At>
double mean_over(ShownColumns shown, At&& at) {
  double sum = 0.0;
  for (std::size_t column = shown.first(); column < shown.end(); ++column) {
    const double left = std::max(shown.from, static_cast<double>(column));
    const double right = std::min(shown.until, static_cast<double>(column + 1));
    sum += (right - left) * at(column);
  }
  const double width = shown.until - shown.from;
  return width > 0.0 ? sum / width : 0.0;
}

/// The greatest at(column) over what a column of a picture shows: of the waterfall's columns whose
/// middle it shows, and of the one in its own middle; 0 for nothing.
template <class At>
double greatest_over(ShownColumns shown, At&& at) {
  if (!(shown.from < shown.until)) return 0.0;
  double greatest = at(shown.middle());
  for (std::size_t column = shown.first(); column < shown.end(); ++column) {
    const double middle = static_cast<double>(column) + 0.5;
    if (shown.from <= middle && middle < shown.until) greatest = std::max(greatest, at(column));
  }
  return greatest;
}

/// Which of the waterfall's columns stands for what a picture's column shows, because labels have
/// no mean: the one nearest to its middle of those with an object or a feature, or else with the
/// shadow of one, or else of all; -1 for nothing.
std::ptrdiff_t labelled_column(const Waterfall& waterfall, std::size_t row, ShownColumns shown);

/// The layers of a waterfall that find_targets() reads, in other columns, 0 where these show
/// nothing; the others are empty.
Waterfall truth_in_columns(PictureColumns columns, const Waterfall& waterfall);

}  // namespace ensonify::engine
