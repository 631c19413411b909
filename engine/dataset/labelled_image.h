#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include <ensonify/engine/base/memory.h>
#include <ensonify/engine/image/display.h>
#include <ensonify/engine/image/waterfall.h>

namespace ensonify::engine {

/// A rectangle of a picture: columns from the left, rows from the top.
struct Rectangle {
  std::size_t column = 0, row = 0, columns = 0, rows = 0;
};

/// The size of a line's view, which is known without its pixels.
struct ViewSize {
  std::string name;  ///< the sonar's; in ground range with "_ground" appended
  std::size_t columns = 0, rows = 0;
  double across_m = 0.0, along_m = 0.0;  ///< size of a pixel; along the track on average
};

/// A line as pictures and labels, all with the same pixels.
struct LabelledImage {
  std::string name;      ///< as in ViewSize
  std::string geometry;  ///< "slant" or "ground"
  Waterfall labels;      ///< only the layers that labels are made from; the others are empty
  std::vector<Picture> pictures;         ///< one per display
  double across_m = 0.0, along_m = 0.0;  ///< as in ViewSize

  ViewSize size() const { return {name, labels.columns(), labels.rows(), across_m, along_m}; }
  Rectangle whole() const { return {0, 0, labels.columns(), labels.rows()}; }
  /// The pixel of a picture that lies at this place in the layers, and the other way round: they
  /// count rows from opposite ends.
  std::size_t flipped(std::size_t row, std::size_t column) const {
    return (labels.rows() - 1 - row) * labels.columns() + column;
  }
};

/// How far along the track each row of a line lies: the vehicle's way over ground from the first
/// ping, plus the beam's offset along the array. Rows of several beams may overlap.
std::vector<double> rows_along_m(const Waterfall& line);

/// The length of track that a line's rows cover.
double length_along_m(const Waterfall& line);

/// The size of slant_view() and of ground_view(), from the sonar and the pings of a line. Throws
/// std::invalid_argument if pixel_m is longer than the range.
ViewSize slant_size(const Waterfall& line);
ViewSize ground_size(const Waterfall& line, double pixel_m);

/// The line in slant range, as recorded.
LabelledImage slant_view(const Waterfall& line, std::vector<Picture> pictures);

/// The line in ground range, as if the bed were level below each ping (Blondel, The Handbook of
/// Sidescan Sonar, 2009, slant-range correction), from the sonar's height over it: square pixels of
/// side pixel_m, each with the values of the nearest row and the bin at its slant range. Pixels
/// without such a bin have no data. `stop_check` is called for each row; what it throws ends the
/// work. Throws as ground_size(), and MemoryError if its pixels do not fit into the memory.
LabelledImage ground_view(const LabelledImage& slant, double pixel_m,
                          const MemoryLimit& memory = {},
                          const std::function<void()>& stop_check = {});

/// How many pixels a length has, at least one; pixel_m is the across_m or along_m of a view. Throws
/// std::invalid_argument if that is 0, because the line does not move.
std::size_t pixels_of(double length_m, double pixel_m);

/// The share of a part's pixels that are seabed, object or shadow, not water.
double bed_share(const LabelledImage& view, const Rectangle& part);

/// A rectangle of a view.
LabelledImage cut(const LabelledImage& view, const Rectangle& part);

/// The view with other numbers of pixels: each label is that of the nearest pixel, each pixel of a
/// picture the mean over its area.
LabelledImage resampled(const LabelledImage& view, std::size_t columns, std::size_t rows);

}  // namespace ensonify::engine
