// The planes of faces are computed by code that is compiled once per Highway target
// (vector_targets.h).

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ensonify/engine/trace/fan_runs.cpp"
#include <ensonify/engine/simd/vector_targets.h>

#include <hwy/foreach_target.h>

#include <algorithm>

#include <hwy/highway.h>

#include <ensonify/engine/simd/cache_lines.h>
#include <ensonify/engine/trace/fan_frame-inl.h>
#include <ensonify/engine/trace/fan_runs.h>

namespace ensonify::engine {

#ifndef ENSONIFY_FACE_PLANES
#define ENSONIFY_FACE_PLANES
/// What find_face_planes() reads and writes, as plain arrays.
struct FacePlanes {
  FanFrame frame;
  double sin_azimuth, cos_azimuth;
  const float* positions;      ///< x, y and z of each position
  const std::uint32_t* faces;  ///< three positions each
  const std::uint32_t* index;  ///< the indices of the `count` faces
  /// As in FanRuns; up to widest_vector values behind the last may be overwritten.
  double *level, *pole, *distance;
};
#endif

}  // namespace ensonify::engine

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {

// The planes of `count` faces within a fan's plane: the same bits as list_runs() gives.
void find_face_planes(const FacePlanes& planes, std::int64_t count) {
  const Frame frame = laid(planes.frame);
  const V sine = hn::Set(d, planes.sin_azimuth), cosine = hn::Set(d, planes.cos_azimuth);
  for (std::int64_t i = 0; i < count; i += lanes) {
    alignas(64) float rows[9 * lanes];
    for (std::int64_t k = 0; k < lanes; ++k) {
      const std::uint32_t* face =
          planes.faces + 3 * std::int64_t{planes.index[i + k < count ? i + k : i]};
      for (std::int64_t corner = 0; corner < 3; ++corner) {
        const float* from = planes.positions + 3 * std::int64_t{face[corner]};
        for (std::int64_t axis = 0; axis < 3; ++axis)
          rows[(3 * corner + axis) * lanes + k] = from[axis];
      }
    }
    const auto corner = [&](std::int64_t k) HWY_ATTR {
      const float* at = rows + 3 * k * lanes;
      return V3{promoted(at), promoted(at + lanes), promoted(at + 2 * lanes)};
    };
    const FacePlane plane =
        face_plane(frame, planes.frame.handedness, {corner(0), corner(1), corner(2)});
    store_cut(plane, sine, cosine, planes.level + i, planes.pole + i, planes.distance + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ensonify::engine {

HWY_EXPORT(find_face_planes);

void FanRuns::start(const FanGrid& grid) {
  first.assign(1, 0);
  const std::size_t room = grid.rays() + widest_vector;
  if (begin.size() >= room) return;
  for (CacheLines<std::uint32_t>* row : {&begin, &end, &index, &face}) row->resize(room);
  for (CacheLines<double>* row : {&level, &pole, &distance}) row->resize(room);
}

void FanRuns::copy_runs(std::size_t run, const FanRuns& other, std::size_t from,
                        std::size_t until) {
  constexpr std::size_t together = 8;  // fast for few runs and for many
  static_assert(together <= widest_vector);
  const auto copy = [&](auto& to, const auto& row) {
    for (std::size_t i = 0; i < until - from; i += together)
      std::copy_n(&row[from + i], together, &to[run + i]);
  };
  for (const auto row : {&FanRuns::begin, &FanRuns::end, &FanRuns::index, &FanRuns::face})
    copy(this->*row, other.*row);
  for (const auto row : {&FanRuns::level, &FanRuns::pole, &FanRuns::distance})
    copy(this->*row, other.*row);
}

void FanRuns::take(const RayFan& fan, refine::Triangles triangles, std::span<const Hit> hits) {
  start(*fan.grid);
  std::size_t count = 0;
  FacePlanes planes{};
  planes.frame = frame_of(fan);
  static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));
  planes.positions = triangles.positions.empty() ? nullptr : triangles.positions.front().data();
  planes.faces = triangles.faces.empty() ? nullptr : triangles.faces.front().data();
  const auto elevations = static_cast<std::uint32_t>(fan.elevations());
  for (std::size_t plane = 0; plane < fan.planes(); ++plane) {
    const Hit* of_plane = hits.data() + plane * elevations;
    std::uint32_t before = Hit::none;
    for (std::uint32_t j = 0; j < elevations; ++j) {
      const std::uint32_t here = of_plane[j].index;
      if (here == before) continue;
      if (before != Hit::none) end[count++] = j;
      if (here != Hit::none) {
        begin[count] = j;
        index[count] = here;
        face[count] = of_plane[j].face;
      }
      before = here;
    }
    if (before != Hit::none) end[count++] = elevations;

    const std::size_t from = first.back();
    planes.sin_azimuth = fan.grid->planes[plane].sin_azimuth;
    planes.cos_azimuth = fan.grid->planes[plane].cos_azimuth;
    planes.index = &index[from];
    planes.level = &level[from];
    planes.pole = &pole[from];
    planes.distance = &distance[from];
    HWY_DYNAMIC_DISPATCH(find_face_planes)(planes, static_cast<std::int64_t>(count - from));
    first.push_back(count);
  }
}

void FanRuns::give_hits(const RayFan& fan, std::span<Hit> hits) const {
  const FanGrid& grid = *fan.grid;
  std::ranges::fill(hits, Hit{});
  for (std::size_t plane = 0; plane < fan.planes(); ++plane)
    for (std::size_t run = first[plane]; run < first[plane + 1]; ++run)
      for (std::size_t ray = begin[run]; ray < end[run]; ++ray) {
        const double facing =
            level[run] * grid.cos_elevation[ray] + pole[run] * grid.sin_elevation[ray];
        hits[plane * fan.elevations() + ray] = {
            .face = face[run], .index = index[run], .t = distance[run] / facing};
      }
}

}  // namespace ensonify::engine
#endif
