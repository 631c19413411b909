#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <ensonify/engine/trace/fan_frame.h>
#include <ensonify/engine/trace/fan_scan/elevation_order.h>
#include <ensonify/refine/height_grid.h>

namespace ensonify::engine {

/// Points of some part of a grid that were moved.
struct MovedPoints {
  const std::uint64_t*
      columns;  ///< by row: of these points, [first, end); the end in the upper half
  const std::int32_t* column_0;  ///< by row: index that a point of column 0 has or would have
  const float* positions;        ///< by index: x, y and z from the fan's origin, and 0
};

/// A bed of heights without holes as plain arrays for the kernels; see refine::HeightGrid::Tile.
struct GridArrays {
  const float *x, *y;           ///< of the columns and the rows of points
  const float* z;               ///< of the first tile
  const std::uint64_t* rising;  ///< of the first tile
  std::int64_t cells_across, cells_up, tiles_across;
  /// If not null, walks follow these points instead, and a walk that leaves them is doubtful.
  const MovedPoints* moved = nullptr;
};

/// A face of a bed of heights, as 64 bits.
struct GridFace {
  static constexpr int second = 0;  ///< bit: it is the second of its cell
  static constexpr int rising = 1;  ///< bit: its cell is split from south-west to north-east
  static constexpr int far = 2;     ///< bit: a corner is out of range
  static constexpr int column = 3;  ///< of the cell, up to bit 31
  static constexpr int row = 32;    ///< of the cell, the bits from here on
};

/// Walks over a grid, one in each lane of a register, of any fans. Each walk follows a plane of the
/// fan from one edge of the mesh to the next. Seen in the direction of the walk, one end of the
/// edge is left of the plane and the other end is right of it; one end is on the positive side of
/// the plane and the other on the negative side.
struct GridWalks {
  static constexpr std::size_t most = 8;  ///< lanes of any register
  template <class T>
  using Lanes = std::array<T, most>;
  /// Of the walk's fan: its FanFrame, the square of its range, a bound on the rounding of a
  /// crossing times its distance from the origin, and the number of its rays.
  alignas(64) std::array<Lanes<double>, 3> origin;
  alignas(64) std::array<Lanes<double>, 9> axes;
  alignas(64) Lanes<double> range_m2, doubt_m2;
  alignas(64) Lanes<std::int64_t> elevations;
  /// The ElevationOrder of the walk's fan. `ascending` and `lines` are distances, counted in
  /// numbers, from the arrays of GridWalkArgs to the arrays of the fan.
  alignas(64) Lanes<std::int64_t> ascending, lines;
  alignas(64) Lanes<double> first_q, steps_per_q, last_step;
  alignas(64) Lanes<double> sin_azimuth, cos_azimuth;
  /// The walk's horizontal direction in the plane: along the plane's elevation 0 and along the
  /// pole; and how far it goes, in metres from the origin.
  alignas(64) Lanes<double> ahead_x, ahead_y, reach_m;
  /// The same direction in columns and rows, scaled so that the greater of the two is 1; only to
  /// prefetch memory.
  alignas(64) Lanes<double> columns_ahead, rows_ahead;
  alignas(64) Lanes<std::int64_t> positive_left;  ///< -1: the left is the positive side
  alignas(64) Lanes<std::int64_t> outwards;       ///< -1: in the order of elevation; 0: against it
  alignas(64) Lanes<std::int64_t> active;         ///< -1; 0 once it has ended
  alignas(64) Lanes<std::int64_t> left_grid;      ///< -1: it ended at the grid's border
  /// -1: a ray passes a crest within rounding, so that the faces before and behind it may be at
  /// one distance.
  alignas(64) Lanes<std::int64_t> doubtful;
  /// The present edge: columns and rows of points.
  alignas(64) Lanes<std::int64_t> left_column, left_row, right_column, right_row;
  /// The ends of the edge: off the plane, along the plane, along the pole, and the squared distance
  /// from the origin.
  alignas(64) Lanes<double> left_off, left_x, left_y, left_2, right_off, right_x, right_y, right_2;
  /// Where the edge crosses the plane, and the number of rays below the crossing.
  alignas(64) Lanes<double> x, y;
  alignas(64) Lanes<std::int64_t> below;
  /// The rays that nothing hides yet: [from, until).
  alignas(64) Lanes<std::int64_t> from, until;
  alignas(64) Lanes<std::int64_t> count;  ///< of intervals
};

struct GridWalkArgs {
  GridArrays grid;
  const double* ascending;  ///< of some fan's ElevationOrder
  const std::uint64_t* lines;
  GridWalks* walks;
  std::int64_t groups;
  /// By walk, in rows of `room`: which rays (the end in the upper half) see which GridFace.
  std::uint64_t *intervals, *faces;
  std::int64_t room;
};

/// Follows all walks to their ends: fills intervals, faces and GridWalks::count.
void walk_grid(const GridWalkArgs& args);

/// How many walks a GridWalks has on this machine: the first lanes are used.
std::int64_t walks_together();

/// Faces that one walk has found, as in GridWalkArgs, in order of rays. One vector more is read.
struct FoundFaces {
  std::uint64_t *intervals, *faces;
  std::int64_t count;
};

/// What lay_runs() reads and writes. Arrays are one vector longer than the most runs.
struct GridRunArgs {
  GridArrays grid;
  // The plane of a fan.
  FanFrame frame;
  double sin_azimuth, cos_azimuth;
  // The next run, as in FanRuns, and the row of its face. No two runs have the same row.
  std::int64_t run, row;
  std::uint32_t *begin, *end, *index, *face;
  double *level, *pole, *distance;
  std::uint32_t* numbers;  ///< by row
  float* positions;        ///< [corner][row]
  std::int64_t rows;
  // The runs whose face is partly out of range.
  std::int64_t far_count;
  std::uint32_t* far;
};

/// Appends runs: rays [from, until) of what a walk of the plane has found. If there are moved
/// points, the planes of the faces go through these points.
void lay_runs(GridRunArgs& args, const FoundFaces& found, std::int64_t from, std::int64_t until);

}  // namespace ensonify::engine
