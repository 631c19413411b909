#pragma once

#include <array>
#include <cstdint>

#include <ensonify/engine/simd/cache_lines.h>
#include <ensonify/engine/trace/fan_frame.h>
#include <ensonify/engine/trace/fan_scan/elevation_order.h>
#include <ensonify/engine/trace/fan_scan/face_blocks.h>
#include <ensonify/engine/trace/ray.h>

namespace ensonify::engine {

/// A block, and which planes of a fan may meet it: they are among [first_plane, last_plane], and
/// the tangents of their azimuths are from `lowest` to `highest`.
struct MetBlock {
  std::uint32_t block, first_plane, last_plane;
  float lowest, highest;
};

/// What fan_scan's loops read and write, as plain arrays. The loops are compiled once per vector
/// target and must share no inline function with the rest of the program: the linker might keep a
/// copy with instructions that the machine does not have.
///
/// A candidate is a face that may cross a plane of the fan. Candidates are in the order of faces.
struct ScanArgs {
  static constexpr std::uint32_t no_candidate = 0xffffffff;

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

  ElevationOrder order;

  // The faces (face_blocks.h).
  const float* block_rows;
  const float* boxes;
  std::int64_t blocks, boxes_in_row;
  const std::uint32_t* numbers;  ///< null: a face's number is its index

  // The results: the blocks that planes may meet; then arrays by candidate; then arrays by ray, in
  // rows of `stride`.
  MetBlock* blocks_met;
  std::int64_t blocks_met_count;
  std::uint32_t* index;  ///< by candidate, of the face
  bool hits_wanted;      ///< hits (fills `forms`) or runs (fills `face_planes`)
  /// [x y z][candidate][u, v, direction . normal, 4th]; the 4th is the distance of the plane for x
  /// and 1 / distance for y.
  double* forms;
  std::int64_t max_candidates;  ///< how many fit in the arrays
  double* face_planes;          ///< [candidate][FacePlane]
  float* nearness;              ///< 1 / t of the nearest face so far, 0 for none
  std::uint32_t* nearest;       ///< the nearest candidate, or no_candidate
  std::int64_t stride;
};

/// How many faces go through the steps together, and the size of the rows they write.
inline constexpr std::int64_t batch_faces = 256, batch_room = batch_faces + widest_vector;
struct ScanBatch {
  std::int64_t count;  // faces
  static constexpr std::int64_t min_tangent = FaceBlocks::rows, max_tangent = min_tangent + 1;
  // As in a block; then the range of azimuths' tangents.
  std::array<float, (max_tangent + 1) * batch_room> rows;
  // The normal over the distance, the least 1 / t (negative: needs double), the greatest.
  std::array<float, 5 * batch_room> planes;
  std::array<double, batch_room> sees_origin;  // 1 where the face's plane goes through the origin
  bool through_origin;                         // whether any face's does
  /// Rows of lists, by plane: where the faces' edges cross the plane (along the plane and along the
  /// pole, for two edges) and the face; later the rays and the face.
  static constexpr std::int64_t list_rows = 5, list_room = batch_faces + 8;
  double* crossings;
  std::int64_t* counts;  ///< by plane
  /// By plane, of all batches: no ray outside [claimed_from, claimed_until) is claimed.
  std::int64_t *claimed_from, *claimed_until;
};

/// Finds the blocks that planes of the fan may meet: fills blocks_met and blocks_met_count.
void find_blocks(ScanArgs& args);

/// Every face of those blocks claims the rays that it is nearest to: fills the other results.
void scan_faces(const ScanArgs& args, ScanBatch& batch);

/// Writes the hits of rays [from, until) of a plane from `hits` on; up to widest_vector hits behind
/// may be overwritten. Rays that need a more careful computation, because rounding may spoil their
/// answer, go into `doubtful` by elevation; returns their count. Clears the z-buffer of those rays.
std::int64_t finish_rays(const ScanArgs& args, std::int64_t plane, std::int64_t from,
                         std::int64_t until, Hit* hits, std::uint32_t* doubtful);

void write_misses(Hit* hits, std::int64_t count);

/// Where runs are written, as in FanRuns; one vector longer than the most runs.
struct RunRows {
  std::uint32_t *begin, *end, *index, *face;
  double *level, *pole, *distance;
};

/// Appends the runs of rays [from, until) of a plane after the first `count`; returns the new
/// count. Clears the z-buffer of those rays.
std::int64_t list_runs(const ScanArgs& args, std::int64_t plane, std::int64_t from,
                       std::int64_t until, const RunRows& rows, std::int64_t count);

}  // namespace ensonify::engine
