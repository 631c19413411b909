#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include <ensonify/engine/base/memory.h>
#include <ensonify/engine/image/display.h>
#include <ensonify/engine/image/fan_picture.h>
#include <ensonify/engine/image/waterfall.h>

namespace ensonify::engine {

/// A rectangle of a picture: columns from the left, rows from the top.
struct Rectangle {
  std::size_t column = 0, row = 0, columns = 0, rows = 0;
};

/// The size of a picture of a line. It is known without the line's pixels.
struct ViewSize {
  std::string name;  ///< the sonar's; in ground range with "_ground" appended
  std::size_t columns = 0, rows = 0;
  double across_m = 0.0, along_m = 0.0;  ///< size of a pixel; along the track the mean
};

/// A line as pictures and labels, all with the same pixels.
struct LabelledImage {
  std::string name;      ///< as in ViewSize
  std::string geometry;  ///< "slant" or "ground"; of a frame "beams" or "fan"
  Waterfall labels;      ///< only the layers that labels are made from; the others are empty
  std::vector<Picture> pictures;         ///< one per display
  double across_m = 0.0, along_m = 0.0;  ///< as in ViewSize

  ViewSize size() const { return {name, labels.columns(), labels.rows(), across_m, along_m}; }
  Rectangle whole() const { return {0, 0, labels.columns(), labels.rows()}; }
  /// The index in the layers of a picture's pixel, and also the index in a picture of the layers'
  /// pixel: pictures and layers count rows from opposite ends.
  std::size_t flipped(std::size_t row, std::size_t column) const {
    return (labels.rows() - 1 - row) * labels.columns() + column;
  }
};

/// The place (m) of each row of a line along the track: the vehicle's way over ground from the
/// first ping, plus the beam's offset along the array. The rows of consecutive pings may overlap if
/// there are several beams.
std::vector<double> rows_along_m(const Waterfall& line);

/// The length of track that a line's rows cover.
double length_along_m(const Waterfall& line);

/// The sizes of slant_view() and ground_view() from the sonar and the pings of a line.
/// ground_size() throws std::invalid_argument if pixel_m is longer than the range.
ViewSize slant_size(const Waterfall& line);
ViewSize ground_size(const Waterfall& line, double pixel_m);

/// The line in slant range, as recorded.
LabelledImage slant_view(const Waterfall& line, std::vector<Picture> pictures);

/// The line in ground range (slant-range correction: Blondel, The Handbook of Sidescan Sonar,
/// 2009). Slant ranges follow from the sonar's height over the bed, as if the bed were level below
/// each ping. The pixels are squares with sides of pixel_m. Each has the values of the nearest row
/// and of the bin at its slant range; a pixel without such a bin has no data. `stop_check` is
/// called for each row; what it throws ends the work. Throws as ground_size(), and MemoryError if
/// the pixels do not fit into the memory.
LabelledImage ground_view(const LabelledImage& slant, double pixel_m,
                          const MemoryLimit& memory = {},
                          const std::function<void()>& stop_check = {});

/// A frame: one ping of an imaging sonar, counted from 0 in its line, as recorded. Each beam is a
/// row and each range bin a column. `pictures` are those of the line.
LabelledImage frame_view(const Waterfall& line, std::size_t ping,
                         const std::vector<Picture>& pictures);

/// A frame as `fan` draws it, seen from above and to scale. A pixel has the labels of the nearest
/// beam and bin; a pixel outside the field of view has no data.
LabelledImage fan_view(const LabelledImage& frame, const FanPicture& fan);

/// The number of pixels of a length, at least 1. `pixel_m` is the across_m or along_m of an image.
/// Throws std::invalid_argument if it is 0, because then the vehicle does not move.
std::size_t pixels_of(double length_m, double pixel_m);

/// The share of the pixels in `part` that are seabed, object or shadow.
double bed_share(const LabelledImage& view, const Rectangle& part);

/// The image of a rectangle of `view`.
LabelledImage cut(const LabelledImage& view, const Rectangle& part);

/// The image with other numbers of columns and rows. A label is that of the nearest pixel; a
/// picture's pixel is the mean over its area.
LabelledImage resampled(const LabelledImage& view, std::size_t columns, std::size_t rows);

}  // namespace ensonify::engine
