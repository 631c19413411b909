// The layout is compiled once per Highway target, as scan_kernel.cpp is.

#include <ensonify/engine/trace/fan_scan/face_blocks.h>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ensonify/engine/trace/fan_scan/face_blocks.cpp"
#include <ensonify/engine/simd/vector_targets.h>

#include <hwy/foreach_target.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <ensonify/engine/trace/fan_frame-inl.h>
#include <ensonify/engine/trace/intersector.h>

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

constexpr std::int64_t block_faces = FaceBlocks::faces, coordinates = FaceBlocks::coordinates,
                       rows = FaceBlocks::rows;
constexpr double thinnest = 0x1p-50;  // relative to a face's length: its rounding in double

HWY_INLINE M has_area(const Corners& face) {
  const V3 to_b = face.b - face.a, to_c = face.c - face.a, across = face.c - face.b;
  const V3 normal = cross(to_b, to_c);
  const V length2 = hn::Max(dot(to_b, to_b), hn::Max(dot(to_c, to_c), dot(across, across)));
  const V largest = hn::Max(hn::Abs(normal.x), hn::Max(hn::Abs(normal.y), hn::Abs(normal.z)));
  return hn::Gt(largest, hn::Set(d, thinnest) * length2);
}

// Copies the corners of a block's faces, coordinate by coordinate. Places after the last face
// repeat the last face.
HWY_INLINE bool gather(const FaceLayout& layout, std::int64_t first, float* to) {
  for (std::int64_t i = 0; i < block_faces; ++i) {
    const std::int64_t number = first + i < layout.face_count ? first + i : layout.face_count - 1;
    for (std::int64_t corner = 0; corner < 3; ++corner) {
      const std::int64_t position = layout.faces[3 * number + corner];
      if (position >= layout.position_count) return false;
      for (std::int64_t axis = 0; axis < 3; ++axis)
        to[(3 * corner + axis) * block_faces + i] = layout.positions[3 * position + axis];
    }
  }
  return true;
}

// Prefetches the positions of later faces.
HWY_INLINE void fetch(const FaceLayout& layout, std::int64_t first) {
  const std::int64_t end =
      first + block_faces < layout.face_count ? first + block_faces : layout.face_count;
  for (std::int64_t i = 3 * first; i < 3 * end; ++i)
    hwy::Prefetch(layout.positions + 3 * std::int64_t{layout.faces[i]});
}

}  // namespace

// Returns false, and stops, at a position that does not exist, is not finite or is too large.
bool lay_faces(const FaceLayout& layout) {
  const V largest = hn::Set(d, layout.largest_component);
  for (std::int64_t block = 0; block * block_faces < layout.face_count; ++block) {
    const std::int64_t first = block * block_faces;
    alignas(64) float from[coordinates * block_faces];
    fetch(layout, first + 2 * block_faces);
    if (!gather(layout, first, from)) return false;
    float* to = layout.rows + block * rows * block_faces;
    V3 low{largest, largest, largest};
    V3 high{hn::Neg(largest), hn::Neg(largest), hn::Neg(largest)};
    M sound = hn::Eq(largest, largest);
    for (std::int64_t i = 0; i < block_faces; i += lanes, to += lanes) {
      const auto corner = [&](std::int64_t k) HWY_ATTR {
        const float* at = from + 3 * k * block_faces + i;
        const V3 p{promoted(at), promoted(at + block_faces), promoted(at + 2 * block_faces)};
        low = {hn::Min(low.x, p.x), hn::Min(low.y, p.y), hn::Min(low.z, p.z)};
        high = {hn::Max(high.x, p.x), hn::Max(high.y, p.y), hn::Max(high.z, p.z)};
        for (const V x : {p.x, p.y, p.z}) sound = hn::And(sound, hn::Le(hn::Abs(x), largest));
        return p;
      };
      Corners face{corner(0), corner(1), corner(2)};
      const V turn = put_in_order(face);
      const M real =
          hn::And(has_area(face),
                  hn::FirstN(d, first + i < layout.face_count
                                    ? static_cast<std::size_t>(layout.face_count - first - i)
                                    : 0));
      face.b = choose(real, face.b, face.a);
      face.c = choose(real, face.c, face.a);
      std::int64_t row = 0;
      const auto store = [&](V x) HWY_ATTR {
        hn::StoreU(hn::DemoteTo(df, x), df, to + block_faces * row++);
      };
      for (const V3& p : {face.a, face.b, face.c}) store(p.x), store(p.y), store(p.z);
      store(turn);
    }
    if (!hn::AllTrue(d, sound)) return false;
    const auto least = [&](V x) HWY_ATTR { return hn::GetLane(hn::MinOfLanes(d, x)); };
    const auto greatest = [&](V x) HWY_ATTR { return hn::GetLane(hn::MaxOfLanes(d, x)); };
    const double box[6] = {least(low.x),     least(low.y),     least(low.z),
                           greatest(high.x), greatest(high.y), greatest(high.z)};
    for (std::int64_t row = 0; row < 6; ++row)
      layout.boxes[row * layout.boxes_in_row + block] = static_cast<float>(box[row]);
  }
  return true;
}

}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ensonify::engine {

HWY_EXPORT(lay_faces);

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
  if (!HWY_DYNAMIC_DISPATCH(lay_faces)(layout))
    check_vertices(triangles);  // throws with the reason
  count = blocks;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    float* low = &boxes[axis * in_row];
    float* high = low + 3 * in_row;
    for (std::size_t block = 0; block < blocks; ++block) {
      const double from = low[block], until = high[block];
      low[block] = static_cast<float>(0.5 * (from + until));
      high[block] = above(std::max(until - low[block], low[block] - from));
    }
    std::fill(low + blocks, low + in_row, 0.0f);  // find_blocks() skips the padding
    std::fill(high + blocks, high + in_row, 0.0f);
  }
}

}  // namespace ensonify::engine
#endif
