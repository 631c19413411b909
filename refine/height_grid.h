#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::refine {

class HeightTiles;

/// The number of an element in an array of rows.
constexpr std::size_t number_in_rows(int row, int columns, int column) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
         static_cast<std::size_t>(column);
}

/// A surface that is kept as the heights of a grid, whose columns run east and whose rows run
/// north. Faces are computed when they are needed: two for every cell that has all four heights,
/// row by row from the south-west, counter-clockwise seen from above. A cell is split along the
/// diagonal that is shorter in space; if both are equal, along the one from the south-west corner.
/// The vertices are the grid points that a face uses, in row order. All threads share it; copies
/// share the memory.
///
/// The grid is in memory, or its tiles are in a file and are made when they are first needed
/// (HeightTiles, height_tiles.h). If tiles are in a file, holes leave gaps in the numbers of the
/// faces. The counts, the bounds and the mean are then estimates, because not all tiles are made.
///
/// It takes 2.5 bytes per face, in memory or in the file.
class HeightGrid {
 public:
  static constexpr int tile_cells = 64;               ///< cells of a tile, in both directions
  static constexpr int tile_points = tile_cells + 1;  ///< neighbours share the points between them
  static constexpr int block_cells = 4;  ///< cells of a block, the smallest part with a Range
  static constexpr int tile_blocks = tile_cells / block_cells;
  static constexpr int group_blocks = 4;  ///< blocks of a group, in both directions
  static constexpr int tile_groups = tile_blocks / group_blocks;

  /// The lowest and the highest height of all faces of some cells. Without faces, lowest > highest.
  struct Range {
    float lowest = std::numeric_limits<float>::infinity();
    float highest = -std::numeric_limits<float>::infinity();
    /// The range of cells that are not made yet.
    static constexpr Range not_known() {
      return {-std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity()};
    }
    bool empty() const { return lowest > highest; }
    bool known() const { return lowest != -std::numeric_limits<float>::infinity(); }
    void take(const Range& other) {
      lowest = other.lowest < lowest ? other.lowest : lowest;
      highest = other.highest > highest ? other.highest : highest;
    }
  };

  /// All data of 64 x 64 cells. Rows and columns count from the tile's south-west corner. Beyond
  /// the grid's border there are no faces.
  struct Tile {
    std::array<std::uint64_t, tile_cells> whole;   ///< by row, a bit per cell: whether it has faces
    std::array<std::uint64_t, tile_cells> rising;  ///< whether its diagonal begins at south-west
    std::array<std::uint32_t, tile_cells> first_face;  ///< number of the row's first face here
    /// Heights by row; NaN where there is none. The last element, 0, fills the tile up to 8 bytes.
    std::array<float, tile_points * tile_points + 1> z_m;
    std::array<Range, tile_groups * tile_groups> groups;
    std::array<Range, tile_blocks * tile_blocks> blocks;
    std::array<std::byte, 120> unused;  ///< 0; a tile has five pages
    float z(int column, int row) const {
      const int point = row * tile_points + column;
      return z_m[static_cast<std::size_t>(point)];
    }
  };
  static_assert(sizeof(Tile) == 20480);

  /// Corners of a cell, and the two faces that each kind of cell has.
  enum Corner : std::uint32_t { south_west, south_east, north_west, north_east };
  static constexpr std::array<Face, 2> rising_faces = {
      {{south_west, south_east, north_east}, {south_west, north_east, north_west}}};
  static constexpr std::array<Face, 2> falling_faces = {
      {{south_west, south_east, north_west}, {south_east, north_east, north_west}}};

  struct Cell {
    bool whole;                        ///< otherwise it has no faces
    std::uint32_t first_face;          ///< the number of the first of its two faces
    const std::array<Face, 2>& faces;  ///< Corners
  };

  HeightGrid() = default;
  /// A grid whose tiles are in a file. Mean, lowest and highest height are those of the Shape.
  explicit HeightGrid(std::shared_ptr<HeightTiles> tiles);

  int columns() const { return static_cast<int>(x_.size()); }  ///< of points
  int rows() const { return static_cast<int>(y_.size()); }
  const Eigen::Vector3d& world_origin() const { return world_origin_; }
  std::size_t faces() const { return counts_.faces; }
  std::size_t vertices() const { return counts_.vertices; }
  /// The mean over all corners of all faces.
  double mean_height_m() const { return counts_.mean_height_m; }
  /// Bounds of the vertices; both corners are zero without faces.
  const Bounds& bounds() const { return counts_.bounds; }
  /// Bounds on the slopes (rise / run) of faces, to the east and north; infinite for tiles in a
  /// file.
  const Eigen::Vector2d& steepest() const { return counts_.steepest; }

  std::span<const float> x() const { return x_; }  ///< of each column, m
  std::span<const float> y() const { return y_; }  ///< of each row, m
  float x(int column) const { return x_[static_cast<std::size_t>(column)]; }
  float y(int row) const { return y_[static_cast<std::size_t>(row)]; }

  static int tiles_across(int points) { return (points - 2) / tile_cells + 1; }
  int tile_columns() const { return tiles_across(columns()); }
  int tile_rows() const { return tiles_across(rows()); }
  /// If the tiles are in a file, throws what HeightTiles::require() throws.
  const Tile& tile(int column, int row) const {
    const std::size_t number = tile_number(column, row);
    if (in_file_ != nullptr) require(number);
    return tiles_[number];
  }
  /// Level 0 has a Range per tile. Each further level has a Range for 2 x 2 of the level below it.
  /// The last level has a single Range.
  int levels() const { return static_cast<int>(levels_.size()); }
  bool has_range(int level, int column, int row) const {
    const Level& at = levels_[static_cast<std::size_t>(level)];
    return column < at.columns && row < at.rows;
  }
  Range range(int level, int column, int row) const {
    if (level == 0 && in_file_ != nullptr) return range_in_file(tile_number(column, row));
    const Level& at = levels_[static_cast<std::size_t>(level)];
    return at.ranges[number_in_rows(row, at.columns, column)];
  }
  /// The tiles, if they are in a file; otherwise null.
  HeightTiles* tiles_in_file() const { return in_file_.get(); }

  /// The cell north-east of a point.
  Cell cell(int column, int row) const;
  /// The kind of a face, for a grid whose tiles have kinds (HeightTiles): the kind of two or three
  /// of its corners, or of the first corner if all three are different.
  std::uint8_t kind_of(std::uint32_t face) const;
  /// The position of a grid point; z is NaN where there is no height.
  Eigen::Vector3f point(int column, int row) const;
  /// The heights of the points of a row from a column on; NaN where there is none.
  void heights(int row, int first_column, std::span<float> z_m) const;

  /// Whether each of the points [first_column, end_column] of a row is used by a face that lies
  /// directly north or south of the row, between these columns, and in a row of cells from
  /// first_row to end_row - 1. One element per point.
  void used_points(int row, int first_column, int end_column, int first_row, int end_row,
                   std::vector<std::uint8_t>& used) const;

  /// The faces of the cells [first_column, end_column) x [first_row, end_row), in order, with the
  /// vertices that they use, in order. If `numbers` is not null, appends the numbers of the faces.
  /// Throws MeshError if there are more vertices than 32 bits can number. `stop_check` is called
  /// for each row; its exceptions end the work.
  TriangleMesh mesh(int first_column, int end_column, int first_row, int end_row,
                    std::vector<std::uint32_t>* numbers = nullptr,
                    const std::function<void()>& stop_check = {}) const;
  /// All faces.
  TriangleMesh mesh(const std::function<void()>& stop_check = {}) const {
    return mesh(0, columns() - 1, 0, rows() - 1, nullptr, stop_check);
  }

  /// Memory, in bytes, of a grid with these numbers of points.
  static double bytes_of(double columns, double rows);

 private:
  friend class HeightGridBuilder;

  struct Counts {
    std::uint64_t faces = 0, vertices = 0;
    double mean_height_m = 0.0;
    Bounds bounds;
    Eigen::Vector2d steepest = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  };
  struct Level {
    int columns = 0, rows = 0;
    std::vector<Range> ranges;
  };

  HeightGrid(std::vector<float> x_m, std::vector<float> y_m, const Eigen::Vector3d& world_origin);
  std::size_t tile_number(int column, int row) const {
    return number_in_rows(row, tile_columns(), column);
  }
  void make_levels(std::vector<Range> of_tiles);
  void require(std::size_t tile) const;
  Range range_in_file(std::size_t tile) const;

  Counts counts_;
  std::vector<float> x_, y_;  // of columns and rows
  Eigen::Vector3d world_origin_ = Eigen::Vector3d::Zero();
  std::vector<Level> levels_;
  std::span<const Tile> tiles_;
  std::shared_ptr<const std::vector<Tile>> own_;
  std::shared_ptr<HeightTiles> in_file_;
};

/// The cells between two rows of heights, at most 64.
struct RowOfCells {
  std::uint64_t whole = 0;   ///< as in HeightGrid::Tile
  std::uint64_t rising = 0;  ///< also of cells that are not whole
};
/// Computes the cells between the heights `south` and `north` of two rows of points; there is one
/// cell less than points. `tile_south` has the heights of `south` as floats in a tile, where those
/// of `north` follow as the tile's next row. Throws MeshError, with the number of the row of cells
/// in the grid, if a height of a whole cell does not fit a float.
RowOfCells row_of_cells(std::span<const double> south, std::span<const double> north,
                        const float* tile_south, int row_in_grid);

/// The most vertices, or faces, that a mesh can number.
inline constexpr std::uint64_t max_numbers = std::numeric_limits<std::uint32_t>::max();
/// Throws MeshError for a grid of fewer than 2 x 2 points, because it has no cell.
void check_has_cell(std::size_t columns, std::size_t rows);
/// Throws MeshError for a grid whose faces are more than a mesh can number.
[[noreturn]] void throw_too_many_faces(std::size_t columns, std::size_t rows);

/// Fills the ranges of a tile's blocks and groups; returns the range of the whole tile.
HeightGrid::Range fill_ranges(HeightGrid::Tile& tile);

/// Makes a HeightGrid from rows of heights, beginning in the south.
class HeightGridBuilder {
 public:
  /// x_m and y_m: the places of columns to the east and of rows to the north (m, local, ascending).
  /// Throws MeshError for fewer than 2 x 2 points, and for places that are not finite.
  HeightGridBuilder(std::vector<float> x_m, std::vector<float> y_m,
                    const Eigen::Vector3d& world_origin);
  /// Adds the next row: one height (m) per column, NaN for a hole. Throws MeshError if a height of
  /// a face does not fit a float, and for more faces than 32 bits can number.
  void add_row(std::span<const double> z_m);
  /// Returns the grid when all rows were added. Throws MeshError if no cell has all four heights.
  HeightGrid finish() &&;

 private:
  void take_heights(std::span<const double> z_m);
  void take_cells(std::span<const double> north);
  Eigen::Vector2d steepest() const;
  void count_vertices(std::span<const std::uint64_t> north);

  HeightGrid grid_;
  std::vector<HeightGrid::Tile> tiles_;
  int rows_ = 0;                               // so far
  std::vector<double> south_;                  // the row before
  std::vector<std::uint64_t> whole_, before_;  // of the last two rows of cells, a bit per cell
  double sum_m_ = 0.0;                         // of all corners of all faces
  // Extent of the points that faces use.
  int west_ = 0, east_ = -1, first_row_ = 0, last_row_ = -1;
  std::uint64_t vertices_ = 0;
};

}  // namespace ensonify::refine
