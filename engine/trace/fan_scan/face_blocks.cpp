#include <ensonify/engine/trace/fan_scan/face_blocks.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <ensonify/engine/trace/fan_scan/face_layout.h>
#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {
namespace {

float above(double x) {
  const auto rounded = static_cast<float>(x);
  return rounded < x ? std::nextafter(rounded, std::numeric_limits<float>::infinity()) : rounded;
}

}  // namespace

void FaceBlocks::take(refine::Triangles triangles) {
  count = 0;
  const std::size_t blocks = (triangles.faces.size() + faces - 1) / faces;
  if (rows_of.size() < blocks * rows * faces) rows_of.resize(blocks * rows * faces);
  const std::size_t in_row = (blocks + together - 1) / together * together;
  boxes.resize(6 * in_row);
  if (blocks == 0) return;

  static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));
  const std::span positions = triangles.positions;
  const FaceLayout layout{.positions = positions.empty() ? nullptr : positions.front().data(),
                          .position_count = static_cast<std::int64_t>(positions.size()),
                          .faces = triangles.faces.front().data(),
                          .face_count = static_cast<std::int64_t>(triangles.faces.size()),
                          .largest_component = static_cast<float>(largest_component),
                          .rows = rows_of.data(),
                          .boxes = boxes.data(),
                          .boxes_in_row = static_cast<std::int64_t>(in_row)};
  if (!lay_faces(layout)) check_vertices(triangles);  // throws with the reason
  count = blocks;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    float* low = &boxes[axis * in_row];
    float* high = low + 3 * in_row;
    for (std::size_t block = 0; block < blocks; ++block) {
      const double from = low[block], until = high[block];
      low[block] = static_cast<float>(0.5 * (from + until));
      high[block] = above(std::max(until - low[block], low[block] - from));
    }
    std::fill(low + blocks, low + in_row, 0.0f);  // the padding is never met: see find_blocks
    std::fill(high + blocks, high + in_row, 0.0f);
  }
}

}  // namespace ensonify::engine
