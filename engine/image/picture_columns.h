#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/image/line_layout.h>
#include <ensonify/engine/image/waterfall.h>

namespace ensonify::engine {

/// How the columns of a picture lie: equally spaced in slant range or in ground range.
struct PictureColumns {
  bool over_ground;
  std::size_t per_side;  ///< columns per sector, at most one per bin

  LineLayout layout(const Sonar& sonar) const { return {sonar.sectors(), per_side}; }

  friend bool operator==(const PictureColumns&, const PictureColumns&) = default;
};

/// The columns of the waterfall itself: one per bin.
PictureColumns columns_of_bins(const Sonar& sonar);

/// The columns that a display asks for. `row_spacing_m` is as in Calibration.
PictureColumns picture_columns(const Sonar& sonar, const Display& display, double row_spacing_m);

/// The sonar's height above the bed, with the bed taken as level: from the row's record or, without
/// one, the slant range of the first echo.
double height_over_bed_m(const Waterfall& waterfall, std::size_t row);

/// What a column of a picture shows: the waterfall's columns from `from` to `until`. Fractions mean
/// that it shows only a part of the first or last column. Equal numbers mean that it shows nothing.
struct ShownColumns {
  double from, until;

  std::size_t first() const { return static_cast<std::size_t>(from); }
  std::size_t end() const { return static_cast<std::size_t>(std::ceil(until)); }
  /// The waterfall's column in the middle. Only if something is shown.
  std::size_t middle() const { return static_cast<std::size_t>(0.5 * (from + until)); }
};

/// What each column of a picture shows in one row.
std::vector<ShownColumns> shown_columns(const Waterfall& waterfall, std::size_t row,
                                        PictureColumns columns);

/// The mean of at(column) over what a column of a picture shows; 0 if it shows nothing.
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

/// The greatest at(column) of the waterfall's columns whose middle a column of a picture shows, and
/// of the waterfall's column in the middle of that column; 0 if it shows nothing.
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

/// The waterfall's column whose labels a picture's column gets. (A mean of labels has no meaning.)
/// Of the columns with an object or a feature, it is the one nearest to the middle of the picture's
/// column. If there are none, it is the nearest of the columns with the shadow of an object or
/// feature; if there are none of these either, the nearest of all columns. -1 if the picture's
/// column shows nothing.
std::ptrdiff_t labelled_column(const Waterfall& waterfall, std::size_t row, ShownColumns shown);

/// The layers that find_targets() reads, in other columns; 0 where a column shows nothing.
Waterfall truth_in_columns(PictureColumns columns, const Waterfall& waterfall);

}  // namespace ensonify::engine
