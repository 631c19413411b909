#include <ensonify/refine/tiles_in_view.h>

#include <algorithm>
#include <cmath>

#include <ensonify/refine/ball_tree.h>

namespace ensonify::refine {

void TilesInView::look_at(std::span<const FanVolume> volumes) {
  view_.look_at(volumes);
  strips_.clear();
  for (const FanVolume& v : volumes) {
    // A point p of the volume has |p . axis| <= range sin(truncation), p . middle >= 0 and |p.z| <=
    // range. On a map of up to 1000 km, rounding is much less than the added 0.01 m.
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
}

/// Whether a volume can touch an infinitely high vertical cylinder.
bool TilesInView::touches_map(const Eigen::Vector2d& centre, double radius_m) const {
  return std::ranges::any_of(strips_, [&](const Strip& strip) {
    const Eigen::Vector2d p = centre - strip.apex;
    return p.norm() <= strip.reach_m + radius_m &&
           std::abs(p.dot(strip.axis)) <= strip.beside_m + radius_m &&
           -p.dot(strip.middle) <= strip.behind_m + radius_m;
  });
}

// The result must not depend on which tiles were made before, because other faces make other trees,
// and Embree's rounding depends on the tree. So a tile is taken only if its own circle and ball can
// touch a volume, and a node above tiles may be left out only if none of them can be taken. A box's
// own circle or ball, widened by sqrt(2), includes those of all boxes within the box.
bool TilesInView::can_touch(const HeightGrid::Range& range, int level, int column, int row) const {
  const int size = HeightGrid::tile_cells << level;
  const int first_column = column * size, first_row = row * size;
  Bounds box{{grid_->x(first_column), grid_->y(first_row), 0.0f},
             {grid_->x(std::min(first_column + size, grid_->columns() - 1)),
              grid_->y(std::min(first_row + size, grid_->rows() - 1)), 0.0f}};
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
}

}  // namespace ensonify::refine
