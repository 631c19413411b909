#pragma once

#include <cstddef>
#include <cstdint>

#include <ensonify/engine/simd/cache_lines.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// Triangles laid out for vector registers: blocks of 16 faces, with one row of 16 per coordinate,
/// and a box around each block.
///
/// Each face begins with the corner that is lowest in (x, y, z), so that faces at one place go
/// through the same computation, whatever the order of their corners; `turn` is the number of that
/// corner in the source. A face without area, or too thin for double (2^-50 of its length), becomes
/// a point.
struct FaceBlocks {
  static constexpr std::size_t faces = 16;       ///< per block
  static constexpr std::size_t coordinates = 9;  ///< x y z of the three corners
  static constexpr std::size_t turn_row = coordinates;
  static constexpr std::size_t rows = turn_row + 1;
  static constexpr std::size_t together = 16;  ///< boxes are padded to a multiple of this

  std::size_t count = 0;
  CacheLines<float> rows_of;  ///< [block][row][face], may be longer than needed
  CacheLines<float> boxes;    ///< [middle x y z, half width x y z][block], rows of boxes_in_row()

  std::size_t boxes_in_row() const { return (count + together - 1) / together * together; }

  /// Throws refine::MeshError as check_vertices does; then there are no blocks.
  void take(refine::Triangles triangles);
};

/// What the loop of FaceBlocks::take() reads and writes, as plain arrays (see ScanArgs). A box is
/// written as lowest x, y, z and highest x, y, z.
struct FaceLayout {
  const float* positions;  ///< x, y and z of each position
  std::int64_t position_count;
  const std::uint32_t* faces;  ///< three positions each
  std::int64_t face_count;
  float largest_component;
  float* rows;
  float* boxes;
  std::int64_t boxes_in_row;
};

}  // namespace ensonify::engine
