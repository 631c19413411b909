#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include <ensonify/engine/seafloor/bed/tiled_field.h>

namespace ensonify::engine {

/// Heights over a large grid that are made block by block (see TiledField::add_block()) and rounded
/// to floats. The most recently used blocks are kept in memory. Thread-safe.
class HeightBlocks {
 public:
  static constexpr int block = TiledField::block_points;  ///< points in each direction

  /// Adds the heights of the block (column, row) to zeros, row by row. Several threads call it.
  using Make = std::function<void(int column, int row, std::vector<double>& z_m)>;

  HeightBlocks(int columns, int rows, Make make);

  /// Calls take(column in the window, row in it, height) for each point. Throws what make() throws.
  template <class Take>
  void for_each(int first_column, int first_row, int columns, int rows, Take&& take) {
    for (int row = first_row / block; row <= (first_row + rows - 1) / block; ++row)
      for (int column = first_column / block; column <= (first_column + columns - 1) / block;
           ++column) {
        const int from_column = std::max(first_column, column * block);
        const int from_row = std::max(first_row, row * block);
        const int end_column = std::min(first_column + columns, (column + 1) * block);
        const int end_row = std::min(first_row + rows, (row + 1) * block);
        // A window that ends with the first row or column of a block needs only this border.
        const bool is_border = end_column - column * block == 1 || end_row - row * block == 1;
        const float* const border = is_border ? known_border(column, row) : nullptr;
        const BlockInUse whole = border ? BlockInUse() : block_at(column, row);
        for (int j = from_row; j < end_row; ++j)
          for (int i = from_column; i < end_column; ++i) {
            const auto x = static_cast<std::size_t>(i - column * block);
            const auto y = static_cast<std::size_t>(j - row * block);
            take(i - first_column, j - first_row,
                 whole ? whole->z_m[y * block + x] : border[y == 0 ? x : block + y]);
          }
      }
  }

 private:
  using Place = std::pair<int, int>;  // row, column
  /// The memory of blocks is reused, and all borders are in one array: freed and allocated among
  /// the large arrays of transforms, they would fragment the memory.
  struct Block {
    Place place{-1, -1};
    std::uint64_t used = 0;  // larger for blocks that were used later
    int users = 0;           // number of threads that use it
    std::mutex making;
    bool made = false;
    std::vector<float> z_m;
  };
  using BlockInUse = std::unique_ptr<Block, std::function<void(Block*)>>;

  std::size_t number_of(const Place& place) const {
    return static_cast<std::size_t>(place.first) * static_cast<std::size_t>(across_) +
           static_cast<std::size_t>(place.second);
  }
  const float* known_border(int column, int row);
  BlockInUse block_at(int column, int row);
  Block& block_for(const Place& place);
  void fill(Block& to, const Place& place);

  const int across_;
  const Make make_;
  std::mutex mutex_;  // for the members below
  std::uint64_t uses_ = 0;
  std::vector<std::unique_ptr<Block>> blocks_;
  std::vector<float> borders_;
  std::vector<std::uint8_t> has_border_;
};

/// A TiledField, rounded to floats, in windows of its grid. Thread-safe.
class FieldInWindows {
 public:
  /// Parameters and exceptions as in TiledField.
  FieldInWindows(const Heightfield& grid, SpectralField what, std::uint64_t seed, Purpose purpose,
                 std::uint64_t number = 0);
  FieldInWindows(const FieldInWindows&) = delete;
  FieldInWindows& operator=(const FieldInWindows&) = delete;

  /// Adds the field to the heights of a window, row by row.
  void add(int first_column, int first_row, int columns, int rows, std::span<double> z_m);

 private:
  TiledField field_;
  HeightBlocks blocks_;
};

}  // namespace ensonify::engine
