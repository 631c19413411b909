#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "support/meshes.h"

#include <ensonify/refine/height_grid.h>
#include <ensonify/refine/height_tiles.h>

namespace ensonify::tests {

/// Heights on a grid, before they are one.
struct Heights {
  int columns, rows;
  double cell_m;
  std::vector<double> z_m;  ///< by row; NaN for a hole

  std::vector<float> x_m() const { return lines(columns); }
  std::vector<float> y_m() const { return lines(rows); }
  refine::HeightGrid grid() const {
    refine::HeightGridBuilder builder(x_m(), y_m(), Eigen::Vector3d::Zero());
    for (std::size_t row = 0; row < static_cast<std::size_t>(rows); ++row)
      builder.add_row(std::span(z_m).subspan(row * static_cast<std::size_t>(columns),
                                             static_cast<std::size_t>(columns)));
    return std::move(builder).finish();
  }
  /// The same heights in tiles that are made when they are needed. The tiles use these heights, so
  /// these must live longer. The tiles' mean height is 0, and they are not written to a file.
  std::shared_ptr<refine::HeightTiles> tiles() const {
    const auto source = [this](int first_column, int first_row, int width, int height,
                               std::span<double> tile_z_m, std::span<std::uint8_t>) {
      for (int row = 0; row < height; ++row)
        std::copy_n(z_m.begin() + std::ptrdiff_t{first_row + row} * columns + first_column, width,
                    tile_z_m.begin() + std::ptrdiff_t{row} * width);
    };
    return std::make_shared<refine::HeightTiles>(
        x_m(), y_m(), Eigen::Vector3d::Zero(),
        [](refine::HeightTiles::Shape& shape) { shape.mean_height_m = 0.0; }, source,
        std::filesystem::path(), "key");
  }

 private:
  std::vector<float> lines(int count) const {
    std::vector<float> places;
    for (int i = 0; i < count; ++i)
      places.push_back(static_cast<float>((i - 0.5 * (count - 1)) * cell_m));
    return places;
  }
};

/// Random heights about 0; `holes` is the share of points without one.
inline Heights random_heights(int columns, int rows, double cell_m, double relief_m, double holes,
                              std::uint64_t seed) {
  Random random(seed);
  Heights heights{columns, rows, cell_m, {}};
  for (int i = 0; i < columns * rows; ++i) {
    const double z_m = relief_m * uniform(random, -0.5, 0.5);
    heights.z_m.push_back(uniform(random) < holes ? std::numeric_limits<double>::quiet_NaN() : z_m);
  }
  return heights;
}

}  // namespace ensonify::tests
