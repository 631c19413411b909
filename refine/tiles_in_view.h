#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/refine/fan_volume.h>
#include <ensonify/refine/height_grid.h>

namespace ensonify::refine {

/// The tiles of a height grid that fan volumes (of one ping or of several) can touch. The result
/// does not depend on which tiles were made before.
class TilesInView {
 public:
  /// The grid must outlive this object.
  explicit TilesInView(const HeightGrid& grid) : grid_(&grid) {}

  /// Throws std::invalid_argument as ViewTest does.
  void look_at(std::span<const FanVolume> volumes);
  const ViewTest& view() const { return view_; }

  /// Calls take(tile, its column, its row) for each tile. Tiles that are not made yet are made, so
  /// this throws what HeightGrid::tile() throws.
  template <class Take>
  void for_each(Take&& take) const {
    descend(grid_->levels() - 1, 0, 0, take);
  }

 private:
  /// The part of the map that a volume can touch, in local metres.
  struct Strip {
    Eigen::Vector2d apex, axis, middle;
    double reach_m, beside_m, behind_m;
  };
  bool touches_map(const Eigen::Vector2d& centre, double radius_m) const;
  bool can_touch(const HeightGrid::Range& range, int level, int column, int row) const;

  template <class Take>
  void descend(int level, int column, int row, Take& take) const {
    const HeightGrid::Range range = grid_->range(level, column, row);
    if (!can_touch(range, level, column, row)) return;
    if (level > 0) {
      for (const int north : {0, 1})
        for (const int east : {0, 1})
          if (grid_->has_range(level - 1, 2 * column + east, 2 * row + north))
            descend(level - 1, 2 * column + east, 2 * row + north, take);
      return;
    }
    const HeightGrid::Tile& tile = grid_->tile(column, row);
    if (range.known() || can_touch(grid_->range(0, column, row), 0, column, row))
      take(tile, column, row);
  }

  const HeightGrid* grid_;
  ViewTest view_;
  std::vector<Strip> strips_;
};

}  // namespace ensonify::refine
