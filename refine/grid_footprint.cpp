#include <ensonify/refine/grid_footprint.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace ensonify::refine {
namespace {

constexpr int tile_cells = HeightGrid::tile_cells;
constexpr int block_cells = HeightGrid::block_cells;
constexpr int block_points = block_cells + 1;

}  // namespace

ExactFaces GridFootprint::query(std::span<const FanVolume> volumes) {
  view_.look_at(volumes);
  strips_.clear();
  for (const FanVolume& v : volumes) {
    // A point p of the volume has |p . axis| <= range sin(truncation), p . middle >= 0 and |p.z| <=
    // range. Rounding is much less than the added hundredth, for a map of up to 1000 km.
    const double reach_m =
        v.range_m * 1.0001 + v.margin_m + 0.01 + 1e-6 * v.apex.lpNorm<Eigen::Infinity>();
    strips_.push_back(
        {.apex = v.apex.head<2>(),
         .axis = v.array_axis.head<2>(),
         .middle = v.middle.head<2>(),
         .reach_m = reach_m,
         .beside_m = v.range_m * (std::sin(v.truncation_rad) + std::abs(v.array_axis.z())) +
                     (reach_m - v.range_m),
         .behind_m = v.range_m * std::abs(v.middle.z()) + (reach_m - v.range_m)});
  }
  point_count_ = face_count_ = 0;
  descend(grid_->levels() - 1, 0, 0);
  bodies_->walk(view_, [this](std::uint32_t face) { take_body(face); });
  return {std::span(points_).first(point_count_), std::span(faces_).first(face_count_),
          std::span(source_faces_).first(face_count_)};
}

/// Whether a volume can touch a vertical cylinder of any height.
bool GridFootprint::touches_map(const Eigen::Vector2d& centre, double radius_m) const {
  return std::ranges::any_of(strips_, [&](const Strip& strip) {
    const Eigen::Vector2d p = centre - strip.apex;
    return p.norm() <= strip.reach_m + radius_m &&
           std::abs(p.dot(strip.axis)) <= strip.beside_m + radius_m &&
           -p.dot(strip.middle) <= strip.behind_m + radius_m;
  });
}

/// Whether a volume can touch the box of the cells between these rows and columns of points.
bool GridFootprint::touches(const HeightGrid::Range& range, int first_column, int end_column,
                            int first_row, int end_row) const {
  return !range.empty() &&
         view_.touches(ball_around({{grid_->x(first_column), grid_->y(first_row), range.lowest},
                                    {grid_->x(end_column), grid_->y(end_row), range.highest}}));
}

// What a volume can touch must not depend on which tiles were made before: other faces make other
// trees, and Embree's rounding follows the tree. So a tile is taken if its own circle and ball can
// touch a volume, and a node above may only be passed over if none of its tiles can be taken. The
// circles and balls of all boxes within a box lie within sqrt(2) of its own radius.
void GridFootprint::descend(int level, int column, int row) {
  const int size = tile_cells << level;
  const int first_column = column * size, first_row = row * size;
  const Eigen::Vector2f south_west{grid_->x(first_column), grid_->y(first_row)};
  const Eigen::Vector2f north_east{grid_->x(std::min(first_column + size, grid_->columns() - 1)),
                                   grid_->y(std::min(first_row + size, grid_->rows() - 1))};
  const auto can_touch = [&](const HeightGrid::Range& range) {
    Bounds box{{south_west.x(), south_west.y(), 0.0f}, {north_east.x(), north_east.y(), 0.0f}};
    const float widened = level == 0 ? 1.0f : 1.4143f;
    const Sphere on_map = ball_around(box);
    if (!touches_map(on_map.centre.head<2>().cast<double>(), double{widened} * on_map.radius))
      return false;
    if (!range.known()) return true;
    if (range.empty()) return false;
    box.lowest.z() = range.lowest;
    box.highest.z() = range.highest;
    Sphere ball = ball_around(box);
    ball.radius *= widened;
    return view_.touches(ball);
  };
  const HeightGrid::Range range = grid_->range(level, column, row);
  if (!can_touch(range)) return;
  if (level > 0) {
    for (const int north : {0, 1})
      for (const int east : {0, 1})
        if (grid_->has_range(level - 1, 2 * column + east, 2 * row + north))
          descend(level - 1, 2 * column + east, 2 * row + north);
    return;
  }
  const HeightGrid::Tile& tile = grid_->tile(column, row);
  if (!range.known() && !can_touch(grid_->range(0, column, row))) return;
  take_tile(tile, column, row);
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

void GridFootprint::take_body(std::uint32_t face) {
  make_room(3, 1);
  const auto first = static_cast<std::uint32_t>(point_count_);
  for (const std::uint32_t corner : bodies_->triangles().faces[face])
    points_[point_count_++] = bodies_->triangles().positions[corner];
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
