#pragma once

#include <cstdint>

namespace ensonify::engine {

/// What lay_faces reads and writes, as plain arrays: it is compiled as scan_kernel is. The rows are
/// those of FaceBlocks. A box is written as lowest x, y, z and highest x, y, z.
struct FaceLayout {
  const float* positions;  ///< x y z of each
  std::int64_t position_count;
  const std::uint32_t* faces;  ///< three positions each
  std::int64_t face_count;
  float largest_component;
  float* rows;
  float* boxes;
  std::int64_t boxes_in_row;
};

/// Returns false, and stops, at a position that does not exist, is not finite or is too large.
bool lay_faces(const FaceLayout& layout);

}  // namespace ensonify::engine
