#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <ensonify/engine/trace/ray.h>

namespace ensonify::engine {

/// What fan_scan's loops read and write, as plain arrays: they are compiled once for each kind of
/// vector register, and must share no inline function with the rest of the program, which might end up
/// with code that the machine cannot run.
///
/// The fan's frame is x along the array, y to the middle of the sector, z along the pole. A slot is a
/// place for a face of a block that may be met; slots are filled in the faces' order.
struct FanPass {
  static constexpr std::uint32_t no_slot = 0xffffffff;

  // The fan.
  std::array<double, 3> origin;
  std::array<double, 9> axes;  ///< array axis, middle, pole
  double handedness;           ///< of those: 1, or -1 if they are left-handed
  double range_m;
  std::int64_t planes, elevations;
  const double* sin_azimuth;
  const double* cos_azimuth;
  const std::int64_t* left_out_from;  ///< by plane: rays [from, until) are outside the beam
  const std::int64_t* left_out_until;
  const double* sin_elevation;
  const double* cos_elevation;
  const float* sin_elevation_rounded;
  const float* cos_elevation_rounded;

  // Its tables (fan_tables.h).
  const double* ascending;
  const double* below;
  const double* rise;
  double first_q, steps_per_q, steps;
  static constexpr double far_off = 0x1p+30;  ///< is added to guesses that may be more than one off

  // The faces (face_blocks.h).
  const float* block_rows;
  const float* boxes;
  std::int64_t blocks, boxes_in_row;
  const std::uint32_t* numbers;  ///< null: a face's number is its place

  // What is found. Blocks that may be met; per slot, and per ray in rows of `stride`.
  std::uint32_t* met_blocks;
  std::int64_t met;
  /// [x y z][slot][u, v, direction . normal, and behind x the distance of the plane, behind y 1 over it,
  /// behind z the sign that the face's own normal was turned by]
  double* forms;
  std::int64_t slots;
  float* nearness;         ///< 1 / t of the nearest face so far, 0 for none
  std::uint32_t* nearest;  ///< its slot, or no_slot
  std::int64_t stride;
};

/// Room for a register's width behind rows.
inline constexpr std::size_t widest_vector = 64;  // floats

/// How many faces go through the first steps together, and room for what they leave.
inline constexpr std::int64_t batch_blocks = 16;
inline constexpr std::int64_t batch_faces = batch_blocks * 16;
struct FanBatch {
  std::array<float, 5 * batch_faces> planes;    // normal over distance, least and greatest 1 / t
  std::array<double, batch_faces> sees_origin;  // 1 where the face's plane goes through the origin
  bool through_origin;                          // any of them
  /// By plane, rows of a list: where its faces' edges cross the plane (along the plane and the pole, for
  /// two edges) and which face; later which rays, and which face.
  static constexpr std::int64_t list_rows = 5, list_room = batch_faces + 8;
  double* crossings;
  std::int64_t* counts;  ///< by plane
};

/// Which blocks may be met: fills met_blocks and met.
void find_blocks(FanPass& pass);

/// Every face of those blocks takes the rays it is the nearest to: fills forms, nearness, nearest.
void scan_faces(const FanPass& pass, FanBatch& batch);

/// The hits of rays [from, until) of a plane from what was found, into places from `hits` on; up to
/// widest_vector behind them may be overwritten. Rays whose answer rounding may spoil go into
/// `doubtful`, by their elevation, for a careful computation; their count is returned. What was found is
/// forgotten: 0 and no_slot again.
std::int64_t finish_rays(const FanPass& pass, std::int64_t plane, std::int64_t from,
                         std::int64_t until, Hit* hits, std::uint32_t* doubtful);

void write_misses(Hit* hits, std::int64_t count);

/// Places for runs, as FanRuns has them; a register's width more than there may be.
struct RunRows {
  std::uint32_t *begin, *end, *index, *face;
  double *level, *pole, *distance;
};

/// The runs of rays [from, until) of a plane from what was found, behind so many others; how many
/// there are then is returned. What was found is forgotten.
std::int64_t list_runs(const FanPass& pass, std::int64_t plane, std::int64_t from,
                       std::int64_t until, const RunRows& rows, std::int64_t count);

}  // namespace ensonify::engine
