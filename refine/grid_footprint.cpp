#include <ensonify/refine/grid_footprint.h>

#include <algorithm>
#include <array>
#include <bit>

namespace ensonify::refine {
namespace {

constexpr int tile_cells = HeightGrid::tile_cells;
constexpr int block_cells = HeightGrid::block_cells;
constexpr int block_points = block_cells + 1;

}  // namespace

ExactFaces GridFootprint::query(std::span<const FanVolume> volumes) {
  tiles_.look_at(volumes);
  point_count_ = face_count_ = 0;
  tiles_.for_each(
      [this](const HeightGrid::Tile& tile, int column, int row) { take_tile(tile, column, row); });
  bodies_->walk(tiles_.view(), [this](std::uint32_t face, const BallTree::Corners& corners) {
    take_body(face, corners);
  });
  return {std::span(points_).first(point_count_), std::span(faces_).first(face_count_),
          std::span(source_faces_).first(face_count_)};
}

/// Whether a volume can touch the box of the cells between these columns and rows of points.
bool GridFootprint::touches(const HeightGrid::Range& range, int first_column, int end_column,
                            int first_row, int end_row) const {
  return !range.empty() && tiles_.view().touches(ball_around(
                               {{grid_->x(first_column), grid_->y(first_row), range.lowest},
                                {grid_->x(end_column), grid_->y(end_row), range.highest}}));
}

void GridFootprint::take_tile(const HeightGrid::Tile& tile, int tile_column, int tile_row) {
  const int west = tile_column * tile_cells, south = tile_row * tile_cells;
  const auto meets = [&](const HeightGrid::Range& range, int column, int row, int size) {
    return touches(range, west + column, std::min(west + column + size, grid_->columns() - 1),
                   south + row, std::min(south + row + size, grid_->rows() - 1));
  };
  constexpr int group_cells = HeightGrid::group_blocks * block_cells;
  for (int group = 0; group < HeightGrid::tile_groups * HeightGrid::tile_groups; ++group) {
    const int first_column = group % HeightGrid::tile_groups * group_cells;
    const int first_row = group / HeightGrid::tile_groups * group_cells;
    if (!meets(tile.groups[static_cast<std::size_t>(group)], first_column, first_row, group_cells))
      continue;
    for (int row = first_row; row < first_row + group_cells; row += block_cells)
      for (int column = first_column; column < first_column + group_cells; column += block_cells) {
        const auto block = static_cast<std::size_t>(row / block_cells * HeightGrid::tile_blocks +
                                                    column / block_cells);
        if (meets(tile.blocks[block], column, row, block_cells))
          take_block(tile, tile_column, tile_row, column, row);
      }
  }
}

/// Takes those cells of a block that a volume can touch.
void GridFootprint::take_block(const HeightGrid::Tile& tile, int tile_column, int tile_row,
                               int column, int row) {
  make_room(block_points * block_points, 2 * block_cells * block_cells);
  const auto first_point = static_cast<std::uint32_t>(point_count_);
  const int west = tile_column * tile_cells + column, south = tile_row * tile_cells + row;
  const std::size_t faces_before = face_count_;
  for (int j = 0; j < block_cells; ++j) {
    const auto line = static_cast<std::size_t>(row + j);
    const std::uint64_t whole = tile.whole[line], rising = tile.rising[line] >> column;
    std::uint32_t number =
        tile.first_face[line] +
        2 * static_cast<std::uint32_t>(std::popcount(whole & ((std::uint64_t{1} << column) - 1)));
    for (int i = 0; i < block_cells; ++i) {
      if ((whole >> (column + i) & 1) == 0) continue;
      const float a = tile.z(column + i, row + j), b = tile.z(column + i + 1, row + j);
      const float c = tile.z(column + i, row + j + 1), d = tile.z(column + i + 1, row + j + 1);
      if (touches(
              {std::min(std::min(a, b), std::min(c, d)), std::max(std::max(a, b), std::max(c, d))},
              west + i, west + i + 1, south + j, south + j + 1)) {
        const auto at = first_point + static_cast<std::uint32_t>(j * block_points + i);
        const std::array corners{at, at + 1, at + block_points, at + block_points + 1};
        for (const Face& face :
             (rising >> i & 1) != 0 ? HeightGrid::rising_faces : HeightGrid::falling_faces) {
          faces_[face_count_] = {corners[face[0]], corners[face[1]], corners[face[2]]};
          source_faces_[face_count_++] = number++;
        }
      } else {
        number += 2;
      }
    }
  }
  if (face_count_ == faces_before) return;
  for (int j = 0; j < block_points; ++j)
    for (int i = 0; i < block_points; ++i)
      points_[point_count_++] = {grid_->x(std::min(west + i, grid_->columns() - 1)),
                                 grid_->y(std::min(south + j, grid_->rows() - 1)),
                                 tile.z(column + i, row + j)};
}

void GridFootprint::take_body(std::uint32_t face, const BallTree::Corners& corners) {
  make_room(3, 1);
  const auto first = static_cast<std::uint32_t>(point_count_);
  for (const Eigen::Vector3f& corner : corners) points_[point_count_++] = corner;
  faces_[face_count_] = {first, first + 1, first + 2};
  source_faces_[face_count_++] = static_cast<std::uint32_t>(grid_->faces()) + face;
}

void GridFootprint::make_room(std::size_t points, std::size_t faces) {
  const auto grow = [](auto& array, std::size_t least) {
    if (array.size() < least) array.resize(std::max(least, 2 * array.size()));
  };
  grow(points_, point_count_ + points);
  grow(faces_, face_count_ + faces);
  grow(source_faces_, face_count_ + faces);
}

}  // namespace ensonify::refine
