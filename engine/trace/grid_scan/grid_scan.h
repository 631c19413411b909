#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/engine/simd/cache_lines.h>
#include <ensonify/engine/trace/fan_runs.h>
#include <ensonify/engine/trace/fan_scan/fan_tables.h>
#include <ensonify/engine/trace/grid_scan/grid_walk.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/refine/height_grid.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// What the rays of fans hit on a bed of heights, as runs: the same as fan_scan's, to the bit.
///
/// A plane of a fan cuts the bed in one line. This line is followed from face to face. The rays of
/// a face are those above the horizon, that is, above all faces before it. So faces that no plane
/// crosses are never read, and nothing is sorted.
///
/// This is correct if the bed has no hole and the line runs outwards without turning back, that is,
/// if the bed is less steep than the plane. Otherwise take() refuses.
class GridScan {
 public:
  /// The grid must outlive this.
  explicit GridScan(const refine::HeightGrid& grid);

  /// Whether this grid can be scanned at all: it has no holes, and its tiles are in memory.
  bool usable() const { return usable_; }
  /// The diagonal of the largest cell, seen from above.
  double diagonal_m() const { return diagonal_m_; }

  /// Puts other triangles first in triangles(), so that they keep their indices when their runs are
  /// merged with the runs of the bed. `version` changes with these triangles. Takes the memory for
  /// the next fans, `fans`, at once.
  void keep_first(const refine::Triangles& others, std::uint64_t version,
                  std::span<const RayFan> fans);

  /// Finds the runs of these fans. Returns false, without runs, if one of the fans cannot be
  /// scanned in this way.
  bool take(std::span<const RayFan> fans);

  /// The same for one fan and a bed whose points were moved to `moved`, which must hold the points
  /// near the fan's planes. Below the origin no point may move sideways.
  bool take(const RayFan& fan, const MovedPoints& moved);

  /// The runs of the fan with this number.
  FanRuns& runs(std::size_t fan) { return runs_[fan]; }
  /// The faces of the runs, one for each; FanRuns::index counts in them.
  refine::Triangles triangles() const;

 private:
  struct Line;  // where a plane of a fan cuts the bed

  struct FanWalks;  // the walks of one fan
  struct PlaneWalks {
    static constexpr std::size_t none = static_cast<std::size_t>(-1);
    std::size_t outwards = none, inwards = none;
    std::size_t below_nadir = 0;  // how many rays
    std::size_t end = 0;          // end of the rays within the beam that may hit something
  };

  bool take(std::span<const RayFan> fans, std::span<FanRuns> runs);
  bool plan_walks(const FanWalks& walks);
  bool begin_walk(const FanWalks& of_fan, const Line& line, std::size_t plane, bool outwards);
  bool is_above_bed(const Eigen::Vector3d& place) const;
  FanFrame frame(const RayFan& fan) const;
  double allowed_slope() const;
  Eigen::Vector3d from_origin(const RayFan& fan, std::ptrdiff_t column, std::ptrdiff_t row) const;
  bool stayed_on_grid(const FanWalks& of_fan) const;
  FoundFaces found_by(std::size_t walk);
  void collect(const FanWalks& of_fan, FanRuns& runs);
  std::size_t most_rows(std::span<const RayFan> fans) const;
  void make_room(std::size_t faces);

  const refine::HeightGrid* grid_;
  GridArrays arrays_{};
  bool usable_ = false;
  double diagonal_m_ = 0.0;
  double longest_edge_m_ = 0.0;  // a bound
  KnownFanTables tables_;
  std::vector<FanRuns> runs_;

  // The walks of some fans.
  std::vector<GridWalks> walks_;
  std::size_t walk_count_ = 0;
  std::vector<PlaneWalks> of_plane_;            // planes of the first fan, then of the next fan
  ElevationOrder order_{};                      // of the first fan
  std::size_t room_of_walk_ = 0;                // in intervals_ and seen_
  CacheLines<std::uint64_t> intervals_, seen_;  // by walk: rays, and the face that they hit

  // The faces of the runs, with one row per face.
  std::vector<std::uint32_t> numbers_;
  std::vector<Eigen::Vector3f> positions_;  // [corner][row]
  std::vector<refine::Face> corners_;
  std::size_t row_count_ = 0, room_ = 0;
  std::size_t other_count_ = 0;
  std::uint64_t others_ = static_cast<std::uint64_t>(-1);  // the version of the other triangles
  CacheLines<std::uint32_t> far_;  // of a plane: runs whose face is partly out of range
};

}  // namespace ensonify::engine
