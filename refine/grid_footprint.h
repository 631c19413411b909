#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/refine/ball_tree.h>
#include <ensonify/refine/fan_volume.h>
#include <ensonify/refine/footprint.h>
#include <ensonify/refine/height_grid.h>
#include <ensonify/refine/tiles_in_view.h>

namespace ensonify::refine {

/// Finds the faces inside fan volumes (of one ping or of several) of a height grid, and of bodies
/// on it: the same faces as Footprint finds in their progressive mesh, and some more at the
/// volumes' edges. It descends where the box of a block of cells can meet a volume.
class GridFootprint {
 public:
  /// Grid and bodies must outlive this object. The bodies' faces are numbered after the grid's
  /// faces.
  GridFootprint(const HeightGrid& grid, const BallTree& bodies)
      : grid_(&grid), bodies_(&bodies), tiles_(grid) {}

  /// The result is valid until the next call. Allocates no memory in a steady state. Throws
  /// std::invalid_argument as ViewTest does.
  ExactFaces query(std::span<const FanVolume> volumes);

 private:
  bool touches(const HeightGrid::Range& range, int first_column, int end_column, int first_row,
               int end_row) const;
  void take_tile(const HeightGrid::Tile& tile, int tile_column, int tile_row);
  void take_block(const HeightGrid::Tile& tile, int tile_column, int tile_row, int column, int row);
  void take_body(std::uint32_t face, const BallTree::Corners& corners);
  void make_room(std::size_t points, std::size_t faces);

  const HeightGrid* grid_;
  const BallTree* bodies_;
  TilesInView tiles_;
  // The found points and faces; the arrays may be longer.
  std::vector<Eigen::Vector3f> points_;
  std::vector<Face> faces_;
  std::vector<std::uint32_t> source_faces_;
  std::size_t point_count_ = 0, face_count_ = 0;
};

}  // namespace ensonify::refine
