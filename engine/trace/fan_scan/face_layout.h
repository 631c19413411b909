#pragma once

#include <cstdint>

namespace ensonify::engine {

/// What lay_faces reads and writes, as plain arrays: it is compiled as fan_kernel is. The rows are
/// FaceBlocks' own; of each block's box there are the lowest x, y and z and the highest.
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

/// False, with the rest not laid out, for a position that is not there, not finite or too large.
bool lay_faces(const FaceLayout& layout);

}  // namespace ensonify::engine
