#pragma once

#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::tests {

inline double variogram(const engine::Heightfield& field, int east, int north) {
  double sum = 0.0;
  for (int row = 0; row + north < field.rows; ++row)
    for (int column = 0; column + east < field.columns; ++column) {
      const double step = field.at(column + east, row + north) - field.at(column, row);
      sum += step * step;
    }
  return sum / (static_cast<double>(field.columns - east) * (field.rows - north));
}

}  // namespace ensonify::tests
