#include <ensonify/refine/height_grid.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <ensonify/refine/height_tiles.h>

namespace ensonify::refine {
namespace {

using Tile = HeightGrid::Tile;
using Range = HeightGrid::Range;

bool bit(std::uint64_t word, int number) { return (word >> number & 1) != 0; }

/// The range of the heights of all faces in a block.
Range range_of_block(const Tile& tile, int first_column, int first_row) {
  constexpr int cells = HeightGrid::block_cells;
  Range range;
  const auto take = [&](int column, int row) {
    const float z = tile.z(column, row);
    range.take({z, z});
  };
  std::uint64_t all = ~std::uint64_t{0};
  for (int row = first_row; row < first_row + cells; ++row)
    all &= tile.whole[static_cast<std::size_t>(row)] >> first_column;
  constexpr std::uint64_t row_of_cells = (1 << cells) - 1;
  if ((all & row_of_cells) == row_of_cells) {
    for (int row = first_row; row <= first_row + cells; ++row)
      for (int column = first_column; column <= first_column + cells; ++column) take(column, row);
    return range;
  }
  for (int row = first_row; row < first_row + cells; ++row)
    for (int column = first_column; column < first_column + cells; ++column)
      if (bit(tile.whole[static_cast<std::size_t>(row)], column))
        for (const int north : {0, 1})
          for (const int east : {0, 1}) take(column + east, row + north);
  return range;
}

}  // namespace

Range fill_ranges(Tile& tile) {
  Range whole;
  for (int row = 0; row < HeightGrid::tile_blocks; ++row)
    for (int column = 0; column < HeightGrid::tile_blocks; ++column) {
      const Range range =
          range_of_block(tile, column * HeightGrid::block_cells, row * HeightGrid::block_cells);
      tile.blocks[number_in_rows(row, HeightGrid::tile_blocks, column)] = range;
      tile.groups[number_in_rows(row / HeightGrid::group_blocks, HeightGrid::tile_groups,
                                 column / HeightGrid::group_blocks)]
          .take(range);
      whole.take(range);
    }
  return whole;
}

RowOfCells row_of_cells(std::span<const double> south, std::span<const double> north,
                        const float* tile_south, int row_in_grid) {
  const double *s = south.data(), *n = north.data();
  const float *zs = tile_south, *zn = tile_south + HeightGrid::tile_points;
  RowOfCells row;
  float largest = 0.0f;
  for (std::size_t i = 0; i + 1 < south.size(); ++i) {
    const bool all =
        !(std::isnan(s[i]) || std::isnan(s[i + 1]) || std::isnan(n[i]) || std::isnan(n[i + 1]));
    // Both diagonals have the same length on the map, so the one with the smaller step of height is
    // shorter.
    const bool rises = std::abs(n[i + 1] - s[i]) <= std::abs(n[i] - s[i + 1]);
    row.whole |= std::uint64_t{all} << i;
    row.rising |= std::uint64_t{rises} << i;
    const float most = std::max(std::max(std::abs(zs[i]), std::abs(zs[i + 1])),
                                std::max(std::abs(zn[i]), std::abs(zn[i + 1])));
    largest = all && most > largest ? most : largest;
  }
  if (std::isinf(largest))
    throw MeshError(
        fmt::format("row {} or {} of the grid has a height that does not fit the mesh's types",
                    row_in_grid, row_in_grid + 1));
  return row;
}

void check_has_cell(std::size_t columns, std::size_t rows) {
  if (columns < 2 || rows < 2)
    throw MeshError(fmt::format("a grid of {} x {} points has no cell; at least 2 x 2 are needed",
                                columns, rows));
}

void throw_too_many_faces(std::size_t columns, std::size_t rows) {
  throw MeshError(fmt::format(
      "a grid of {} x {} points has more faces than 32 bits can number; make it coarser, or cut "
      "a part out",
      columns, rows));
}

HeightGrid::HeightGrid(std::vector<float> x_m, std::vector<float> y_m,
                       const Eigen::Vector3d& world_origin)
    : x_(std::move(x_m)), y_(std::move(y_m)), world_origin_(world_origin) {
  check_has_cell(x_.size(), y_.size());
  for (const float end : {x_.front(), x_.back(), y_.front(), y_.back()})
    if (!std::isfinite(end))
      throw MeshError("the grid's corners do not fit the mesh's types; use smaller cells");
}

void HeightGrid::make_levels(std::vector<Range> of_tiles) {
  levels_ = {{tile_columns(), tile_rows(), std::move(of_tiles)}};
  while (levels_.back().ranges.size() > 1) {
    const Level& below = levels_.back();
    Level level{(below.columns + 1) / 2, (below.rows + 1) / 2, {}};
    level.ranges.resize(static_cast<std::size_t>(level.columns) *
                        static_cast<std::size_t>(level.rows));
    std::size_t next = 0;
    for (int row = 0; row < below.rows; ++row)
      for (int column = 0; column < below.columns; ++column)
        level.ranges[number_in_rows(row / 2, level.columns, column / 2)].take(below.ranges[next++]);
    levels_.push_back(std::move(level));
  }
}

HeightGrid::HeightGrid(std::shared_ptr<HeightTiles> tiles)
    : x_(tiles->shape().x_m),
      y_(tiles->shape().y_m),
      world_origin_(tiles->shape().world_origin),
      tiles_(tiles->mapped()),
      in_file_(std::move(tiles)) {
  const HeightTiles::Shape& shape = in_file_->shape();
  const auto cells =
      static_cast<std::uint64_t>(columns() - 1) * static_cast<std::uint64_t>(rows() - 1);
  counts_ = {2 * cells,
             shape.x_m.size() * shape.y_m.size(),
             shape.mean_height_m,
             {{x_.front(), y_.front(), shape.lowest_m}, {x_.back(), y_.back(), shape.highest_m}},
             Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity())};
  make_levels(in_file_->ranges());
}

void HeightGrid::require(std::size_t tile) const { in_file_->require(tile); }

HeightGrid::Range HeightGrid::range_in_file(std::size_t tile) const {
  return in_file_->range(tile);
}

HeightGrid::Cell HeightGrid::cell(int column, int row) const {
  const Tile& at = tile(column / tile_cells, row / tile_cells);
  const auto line = static_cast<std::size_t>(row % tile_cells);
  const int place = column % tile_cells;
  const std::uint64_t whole = at.whole[line];
  const auto before =
      static_cast<std::uint32_t>(std::popcount(whole & ((std::uint64_t{1} << place) - 1)));
  return {bit(whole, place), at.first_face[line] + 2 * before,
          bit(at.rising[line], place) ? rising_faces : falling_faces};
}

std::uint8_t HeightGrid::kind_of(std::uint32_t face) const {
  // The first face of a row of a tile has the number that it has if no cell before it is a hole.
  const auto across = static_cast<std::uint32_t>(columns() - 1);
  const int row = static_cast<int>(face / 2 / across);
  const auto in_row = static_cast<int>(face / 2 % across);
  const std::size_t number = tile_number(in_row / tile_cells, row / tile_cells);
  require(number);
  const Tile& at = tiles_[number];
  const int line = row % tile_cells;
  int place = in_row % tile_cells;
  if (std::uint64_t whole = at.whole[static_cast<std::size_t>(line)]; ~whole != 0) {
    for (int before = place; before > 0; --before) whole &= whole - 1;
    place = std::countr_zero(whole);
  }
  const HeightTiles::Kinds& kinds = in_file_->kinds(number);
  const auto south = static_cast<std::size_t>(line * tile_points + place);
  const std::array<std::uint8_t, 4> corners = {
      kinds[south], kinds[south + 1], kinds[south + tile_points], kinds[south + tile_points + 1]};
  const Face& of_face =
      (bit(at.rising[static_cast<std::size_t>(line)], place) ? rising_faces
                                                             : falling_faces)[face % 2];
  const std::uint8_t a = corners[of_face[0]], b = corners[of_face[1]], c = corners[of_face[2]];
  return b == c ? b : a;
}

Eigen::Vector3f HeightGrid::point(int column, int row) const {
  const int tile_column = std::min(column / tile_cells, tile_columns() - 1);
  const int tile_row = std::min(row / tile_cells, tile_rows() - 1);
  return {x(column), y(row),
          tile(tile_column, tile_row)
              .z(column - tile_column * tile_cells, row - tile_row * tile_cells)};
}

void HeightGrid::heights(int row, int first_column, std::span<float> z_m) const {
  const int tile_row = std::min(row / tile_cells, tile_rows() - 1);
  const int end_column = first_column + static_cast<int>(z_m.size());
  for (int column = first_column; column < end_column;) {
    const int tile_column = std::min(column / tile_cells, tile_columns() - 1);
    const int first_of_tile = tile_column * tile_cells;
    const Tile& its = tile(tile_column, tile_row);
    for (const int end = std::min(end_column, first_of_tile + tile_points); column < end; ++column)
      z_m[static_cast<std::size_t>(column - first_column)] =
          its.z(column - first_of_tile, row - tile_row * tile_cells);
  }
}

void HeightGrid::used_points(int row, int first_column, int end_column, int first_row, int end_row,
                             std::vector<std::uint8_t>& used) const {
  used.assign(static_cast<std::size_t>(end_column - first_column) + 1, 0);
  for (int cell_row = std::max(row - 1, first_row); cell_row <= row && cell_row < end_row;
       ++cell_row)
    for (int column = first_column; column < end_column; ++column)
      if (cell(column, cell_row).whole) {
        const auto i = static_cast<std::size_t>(column - first_column);
        used[i] = used[i + 1] = 1;
      }
}

TriangleMesh HeightGrid::mesh(int first_column, int end_column, int first_row, int end_row,
                              std::vector<std::uint32_t>* numbers,
                              const std::function<void()>& stop_check) const {
  TriangleMesh mesh;
  mesh.world_origin = world_origin_;
  if (counts_.vertices > max_numbers)
    throw MeshError(fmt::format("{} vertices are more than a mesh can number", counts_.vertices));
  const bool all =
      first_column == 0 && first_row == 0 && end_column == columns() - 1 && end_row == rows() - 1;
  if (all) mesh.positions.reserve(counts_.vertices);
  if (all) mesh.faces.reserve(counts_.faces);
  const auto points = static_cast<std::size_t>(std::max(0, end_column - first_column)) + 1;
  // The vertices of the rows of points on the south side and on the north side of a row of cells.
  std::vector<std::uint32_t> south(points), north(points, 0);
  std::vector<std::uint8_t> used;
  // Numbers the points of a row that faces use.
  const auto add_points = [&](int row, std::vector<std::uint32_t>& vertex) {
    used_points(row, first_column, end_column, first_row, end_row, used);
    for (std::size_t i = 0; i < points; ++i) {
      if (used[i] == 0) continue;
      vertex[i] = static_cast<std::uint32_t>(mesh.positions.size());
      mesh.positions.push_back(point(first_column + static_cast<int>(i), row));
    }
  };
  if (first_row < end_row) add_points(first_row, north);
  for (int row = first_row; row < end_row; ++row) {
    if (stop_check) stop_check();
    std::swap(south, north);
    add_points(row + 1, north);
    for (int column = first_column; column < end_column; ++column) {
      const Cell here = cell(column, row);
      if (!here.whole) continue;
      const auto i = static_cast<std::size_t>(column - first_column);
      const std::array corners{south[i], south[i + 1], north[i], north[i + 1]};
      for (const Face& face : here.faces)
        mesh.faces.push_back({corners[face[0]], corners[face[1]], corners[face[2]]});
      if (numbers)
        for (const std::uint32_t second : {0u, 1u}) numbers->push_back(here.first_face + second);
    }
  }
  return mesh;
}

double HeightGrid::bytes_of(double columns, double rows) {
  const auto tiles = [](double points) { return std::ceil((points - 1.0) / tile_cells); };
  return tiles(columns) * tiles(rows) * (sizeof(Tile) + 2.0 * sizeof(Range));
}

HeightGridBuilder::HeightGridBuilder(std::vector<float> x_m, std::vector<float> y_m,
                                     const Eigen::Vector3d& world_origin)
    : grid_(std::move(x_m), std::move(y_m), world_origin), west_(grid_.columns()) {
  tiles_.resize(static_cast<std::size_t>(grid_.tile_columns()) *
                static_cast<std::size_t>(grid_.tile_rows()));
  whole_.resize(static_cast<std::size_t>(grid_.tile_columns()));
  before_.resize(whole_.size());
}

void HeightGridBuilder::add_row(std::span<const double> z_m) {
  take_heights(z_m);
  if (rows_ > 0) take_cells(z_m);
  south_.assign(z_m.begin(), z_m.end());
  ++rows_;
}

/// Copies the heights into the one or two rows of tiles that have this row of points.
void HeightGridBuilder::take_heights(std::span<const double> z_m) {
  constexpr int cells = HeightGrid::tile_cells;
  const auto copy = [&](int tile_row, int row) {
    for (int tile_column = 0; tile_column < grid_.tile_columns(); ++tile_column) {
      const int first = tile_column * cells;
      const int count = std::min(HeightGrid::tile_points, grid_.columns() - first);
      float* to = tiles_[grid_.tile_number(tile_column, tile_row)].z_m.data() +
                  row * HeightGrid::tile_points;
      const double* from = z_m.data() + first;
      for (int i = 0; i < count; ++i) to[i] = static_cast<float>(from[i]);
    }
  };
  const int tile_row = rows_ / cells, row = rows_ % cells;
  if (tile_row < grid_.tile_rows()) copy(tile_row, row);
  if (row == 0 && tile_row > 0) copy(tile_row - 1, cells);
}

/// Takes the row of cells between the row before and this one.
void HeightGridBuilder::take_cells(std::span<const double> north) {
  constexpr int cells = HeightGrid::tile_cells;
  const int cell_row = rows_ - 1, row = cell_row % cells;
  const auto line = static_cast<std::size_t>(row);
  std::swap(whole_, before_);
  std::uint64_t& faces = grid_.counts_.faces;
  if (faces + 2 * static_cast<std::uint64_t>(grid_.columns()) > max_numbers)
    throw_too_many_faces(grid_.x_.size(), grid_.y_.size());
  for (int tile_column = 0; tile_column < grid_.tile_columns(); ++tile_column) {
    Tile& tile = tiles_[grid_.tile_number(tile_column, cell_row / cells)];
    const int first = tile_column * cells;
    const int count = std::min(cells, grid_.columns() - 1 - first);
    const double *s = south_.data() + first, *n = north.data() + first;
    const float* zs = tile.z_m.data() + row * HeightGrid::tile_points;
    const float* zn = zs + HeightGrid::tile_points;
    const auto points = static_cast<std::size_t>(count) + 1;
    const RowOfCells found = row_of_cells({s, points}, {n, points}, zs, cell_row);
    const std::uint64_t whole = found.whole;
    for (std::size_t i = 0; i + 1 < points; ++i) {
      if (!bit(whole, static_cast<int>(i))) continue;
      if (bit(found.rising, static_cast<int>(i)))
        sum_m_ = sum_m_ + zs[i] + zs[i + 1] + zn[i + 1] + zs[i] + zn[i + 1] + zn[i];
      else
        sum_m_ = sum_m_ + zs[i] + zs[i + 1] + zn[i] + zs[i + 1] + zn[i + 1] + zn[i];
    }
    tile.whole[line] = whole;
    tile.rising[line] = found.rising & whole;
    tile.first_face[line] = static_cast<std::uint32_t>(faces);
    faces += 2 * static_cast<std::uint64_t>(std::popcount(whole));
    whole_[static_cast<std::size_t>(tile_column)] = whole;
    if (whole == 0) continue;
    west_ = std::min(west_, first + std::countr_zero(whole));
    east_ = std::max(east_, first + cells - std::countl_zero(whole));
    if (last_row_ < 0) first_row_ = cell_row;
    last_row_ = cell_row + 1;
  }
  count_vertices(whole_);
}

/// Counts the points of the row before that faces of cells to its south (before_) or north use.
void HeightGridBuilder::count_vertices(std::span<const std::uint64_t> north) {
  std::uint64_t carry = 0;
  for (std::size_t i = 0; i < before_.size(); ++i) {
    const std::uint64_t cells = before_[i] | north[i];
    vertices_ += static_cast<std::uint64_t>(std::popcount(cells | cells << 1 | carry));
    carry = cells >> 63;
  }
  vertices_ += carry;
}

/// The steepest slopes, from the greatest steps of height along rows and along columns. This is
/// enough, because every face has one edge along a row and one along a column.
Eigen::Vector2d HeightGridBuilder::steepest() const {
  constexpr auto points = static_cast<std::size_t>(HeightGrid::tile_points);
  float greatest_x = 0.0f, greatest_y = 0.0f;
  for (int tile_row = 0; tile_row < grid_.tile_rows(); ++tile_row)
    for (int tile_column = 0; tile_column < grid_.tile_columns(); ++tile_column) {
      const Tile& tile = tiles_[grid_.tile_number(tile_column, tile_row)];
      const auto in_tile = [](int all, int tile_number) {
        return static_cast<std::size_t>(
            std::min(HeightGrid::tile_points, all - tile_number * HeightGrid::tile_cells));
      };
      const std::size_t columns = in_tile(grid_.columns(), tile_column),
                        rows = in_tile(grid_.rows(), tile_row);
      for (std::size_t row = 0; row < rows; ++row) {
        const float* z = &tile.z_m[row * points];
        const float* north = row + 1 < rows ? z + points : z;
        // A hole's NaN is never greater.
        for (std::size_t i = 0; i + 1 < columns; ++i) {
          const float step = std::abs(z[i + 1] - z[i]);
          greatest_x = step > greatest_x ? step : greatest_x;
        }
        for (std::size_t i = 0; i < columns; ++i) {
          const float step = std::abs(north[i] - z[i]);
          greatest_y = step > greatest_y ? step : greatest_y;
        }
      }
    }
  const auto narrowest = [](std::span<const float> lines) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i + 1 < lines.size(); ++i)
      least = std::min(least, double{lines[i + 1]} - double{lines[i]});
    return least;
  };
  return (1.0 + 1e-6) * Eigen::Vector2d(double{greatest_x} / narrowest(grid_.x()),
                                        double{greatest_y} / narrowest(grid_.y()));
}

HeightGrid HeightGridBuilder::finish() && {
  HeightGrid::Counts& counts = grid_.counts_;
  if (counts.faces == 0)
    throw MeshError(fmt::format(
        "none of the {} x {} grid points form a whole cell, so there is no bed; at least four "
        "neighbouring points need heights",
        grid_.columns(), grid_.rows()));
  std::swap(whole_, before_);
  std::ranges::fill(whole_, 0);
  count_vertices(whole_);
  counts.vertices = vertices_;
  counts.mean_height_m = sum_m_ / (3.0 * static_cast<double>(counts.faces));
  counts.steepest = steepest();

  std::vector<Range> of_tiles;
  of_tiles.reserve(tiles_.size());
  for (Tile& tile : tiles_) of_tiles.push_back(fill_ranges(tile));
  grid_.make_levels(std::move(of_tiles));
  const Range range = grid_.levels_.back().ranges.front();
  counts.bounds = {{grid_.x(west_), grid_.y(first_row_), range.lowest},
                   {grid_.x(east_), grid_.y(last_row_), range.highest}};
  grid_.own_ = std::make_shared<const std::vector<Tile>>(std::move(tiles_));
  grid_.tiles_ = *grid_.own_;
  return std::move(grid_);
}

}  // namespace ensonify::refine
