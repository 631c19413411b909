#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/image/waterfall.h>

namespace ensonify::engine {

/// A rectangle of a picture: columns from the left, rows from the top.
struct Rectangle {
  std::size_t column = 0, row = 0, columns = 0, rows = 0;
};

/// A line as pictures and their labels, pixel by pixel the same.
struct LabelledImage {
  std::string name;      ///< of the sonar; of its ground range with _ground behind
  std::string geometry;  ///< slant or ground
  Waterfall labels;
  std::vector<Picture> pictures;         ///< one a display
  double across_m = 0.0, along_m = 0.0;  ///< size of a pixel; along: on average

  Rectangle whole() const { return {0, 0, labels.columns(), labels.rows()}; }
};

/// The line as it was recorded.
LabelledImage slant_view(const Waterfall& line, std::vector<Picture> pictures);

/// The line in ground range, as if the bed were level below each ping (Blondel, The Handbook of
/// Sidescan Sonar, 2009, slant-range correction): square pixels of that size, each of the nearest
/// ping and the bin at its range. Pixels without one have no data. Throws std::invalid_argument for
/// pixels larger than the line.
LabelledImage ground_view(const LabelledImage& slant, double pixel_m);

/// A part of a view.
LabelledImage cut(const LabelledImage& view, const Rectangle& part);

}  // namespace ensonify::engine
