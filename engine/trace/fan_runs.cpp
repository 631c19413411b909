#include <ensonify/engine/trace/fan_runs.h>

#include <algorithm>

#include <ensonify/engine/simd/cache_lines.h>
#include <ensonify/engine/trace/face_planes.h>

namespace ensonify::engine {

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
    find_face_planes(planes, static_cast<std::int64_t>(count - from));
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
