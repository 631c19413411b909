#pragma once

#include <cstddef>

#include <ensonify/engine/simd/cache_lines.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// Triangles laid out for vector registers: blocks of 16 faces, of each coordinate 16 in a row, and
/// a box around each block.
///
/// Each face begins with the corner that is lowest in (x, y, z), so that faces at one place,
/// whatever their order of corners, go through one computation; its `turn` tells which corner of
/// the source that is. A face without area, or so thin that double cannot tell (2^-50 of its
/// length), becomes a point.
struct FaceBlocks {
  static constexpr std::size_t faces = 16;  ///< a block
  static constexpr std::size_t coordinates =
      9;  ///< x y z of the first corner, the second, the third
  static constexpr std::size_t rows = coordinates + 1;  ///< the last: the turn
  static constexpr std::size_t together = 16;           ///< boxes are padded to a multiple of it

  std::size_t count = 0;
  CacheLines<float> rows_of;  ///< [block][row][face], and what larger meshes left behind
  CacheLines<float> boxes;    ///< [middle x y z, half width x y z][block], rows of boxes_in_row()

  std::size_t boxes_in_row() const { return (count + together - 1) / together * together; }

  /// Throws refine::MeshError as check_vertices does; there are no blocks then.
  void take(refine::Triangles triangles);
};

}  // namespace ensonify::engine
