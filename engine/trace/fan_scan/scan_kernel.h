#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <ensonify/engine/simd/cache_lines.h>
#include <ensonify/engine/trace/fan_frame.h>
#include <ensonify/engine/trace/ray.h>

namespace ensonify::engine {

/// What fan_scan's loops read and write, as plain arrays: they are compiled once for each kind of
/// vector register, and must share no inline function with the rest of the program, which might end
/// up with code that the machine cannot run.
///
/// A slot is a place for a face that may cross a plane of the fan; slots are filled in the faces'
/// order.
struct ScanArgs {
  static constexpr std::uint32_t no_slot = 0xffffffff;

  // The fan.
  FanFrame frame;
  double range_m;
  std::int64_t planes, elevations;
  const double* sin_azimuth;
  const double* cos_azimuth;
  const float* tan_azimuth;
  const std::int64_t* left_out_from;  ///< by plane: rays [from, until) are outside the beam
  const std::int64_t* left_out_until;
  const double* sin_elevation;
  const double* cos_elevation;
  const float* sin_elevation_rounded;
  const float* cos_elevation_rounded;

  // Its tables (fan_tables.h).
  const double* ascending;
  const std::uint64_t* lines;
  double first_q, steps_per_q, steps;

  // The faces (face_blocks.h).
  const float* block_rows;
  const float* boxes;
  std::int64_t blocks, boxes_in_row;
  const std::uint32_t* numbers;  ///< null: a face's number is its place

  // What is found. Blocks that may be met; per slot, and per ray in rows of `stride`.
  std::uint32_t* met_blocks;
  std::int64_t met;
  std::uint32_t* index;  ///< by slot, of the face
  bool hits_wanted;      ///< or else runs: which of the next two is filled
  /// [x y z][slot][u, v, direction . normal, and behind x the distance of the plane, behind y 1
  /// over it]
  double* forms;
  std::int64_t slots;      ///< room for so many
  double* face_planes;     ///< [slot][FacePlane]
  float* nearness;         ///< 1 / t of the nearest face so far, 0 for none
  std::uint32_t* nearest;  ///< its slot, or no_slot
  std::int64_t stride;
};

/// How many faces go through the steps together, and room for what they leave.
inline constexpr std::int64_t batch_faces = 256, batch_room = batch_faces + widest_vector;
struct ScanBatch {
  std::int64_t count;  // faces
  static constexpr std::int64_t min_tangent = 10, greatest_tangent = 11;
  std::array<float, 12 * batch_room> rows;  // of them, as in a block, and of azimuths that they see
  // The normal over the distance, the least 1 / t (negative: float will not do), the greatest.
  std::array<float, 5 * batch_room> planes;
  std::array<double, 3 * batch_room> precise_planes;  // the same normal over distance in double
  std::array<double, batch_room> sees_origin;  // 1 where the face's plane goes through the origin
  bool through_origin;                         // any of them
  /// By plane, rows of a list: where its faces' edges cross the plane (along the plane and the
  /// pole, for two edges) and which face; later which rays, and which face.
  static constexpr std::int64_t list_rows = 5, list_room = batch_faces + 8;
  double* crossings;
  std::int64_t* counts;  ///< by plane
};

/// Which blocks may be met: fills met_blocks and met.
void find_blocks(ScanArgs& pass);

/// Every face of those blocks takes the rays it is the nearest to: fills what is found but for the
/// blocks.
void scan_faces(const ScanArgs& pass, ScanBatch& batch);

/// The hits of rays [from, until) of a plane from what was found, into places from `hits` on; up to
/// widest_vector behind them may be overwritten. Rays whose answer rounding may spoil go into
/// `doubtful`, by their elevation, for a careful computation; their count is returned. What was
/// found is forgotten: 0 and no_slot again.
std::int64_t finish_rays(const ScanArgs& pass, std::int64_t plane, std::int64_t from,
                         std::int64_t until, Hit* hits, std::uint32_t* doubtful);

void write_misses(Hit* hits, std::int64_t count);

/// Places for runs, as FanRuns has them; a register's width more than there may be.
struct RunRows {
  std::uint32_t *begin, *end, *index, *face;
  double *level, *pole, *distance;
};

/// The runs of rays [from, until) of a plane from what was found, behind so many others; how many
/// there are then is returned. What was found is forgotten.
std::int64_t list_runs(const ScanArgs& pass, std::int64_t plane, std::int64_t from,
                       std::int64_t until, const RunRows& rows, std::int64_t count);

}  // namespace ensonify::engine
