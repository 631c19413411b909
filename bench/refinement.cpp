#include "refinement.h"

#include <array>
#include <cmath>

#include <fmt/format.h>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/seafloor/make_seafloor.h>
#include <ensonify/engine/trace/face_sources/exact_faces.h>
#include <ensonify/refine/active_mesh.h>
#include <ensonify/refine/edge_collapse.h>
#include <ensonify/refine/footprint.h>

#include "clock.h"

namespace ensonify::bench {
namespace {

using engine::degree;

constexpr double extent_m = 500.0;
constexpr double depth_m = 40.0;
constexpr double altitude_m = 15.0;
constexpr double range_m = 150.0;
constexpr double advance_m = 0.4;
constexpr int pings = 1000;

/// Port and starboard: from level to straight down, 0.3 degrees to either side of broadside.
std::array<refine::FanVolume, 2> fans_at(int ping) {
  std::array<refine::FanVolume, 2> fans;
  for (std::size_t side = 0; side < 2; ++side) {
    const double out = side == 0 ? -1.0 : 1.0, half = std::sqrt(0.5);
    fans[side] = {.apex = {0.0, (ping - 0.5 * pings) * advance_m, altitude_m - depth_m},
                  .array_axis = Eigen::Vector3d::UnitY(),
                  .middle = {out * half, 0.0, -half},
                  .pole = {out * half, 0.0, half},
                  .truncation_rad = 0.3 * degree,
                  .elevation_low_rad = -45.0 * degree,
                  .elevation_high_rad = 45.0 * degree,
                  .range_m = range_m};
  }
  return fans;
}

/// Builds with the default builder, or with the reference builder.
std::shared_ptr<const refine::ProgressiveMesh> build(const refine::TriangleMesh& mesh,
                                                     bool reference) {
  if (!reference) return engine::make_progressive_mesh(mesh);
  return std::make_shared<const refine::ProgressiveMesh>(refine::build_by_edge_collapse(mesh));
}

RefinementMeasurement measure_on(const std::string& name, double faces, bool reference) {
  engine::SeafloorOptions bed;
  bed.extent_east_m = bed.extent_north_m = extent_m;
  bed.cell_m = extent_m / std::round(std::sqrt(faces / 2.0));
  bed.depth_m = depth_m;
  const refine::TriangleMesh mesh = engine::make_seafloor(bed, 1).mesh;
  RefinementMeasurement result{.name = name, .faces = mesh.faces.size()};
  double start_s = thread_s();
  const auto progressive = build(mesh, reference);
  result.build_s = thread_s() - start_s;
  result.bytes_per_vertex =
      static_cast<double>(progressive->points.size() * sizeof progressive->points[0] +
                          progressive->mid.size() * sizeof progressive->mid[0] +
                          progressive->spheres.size() * sizeof progressive->spheres[0] +
                          progressive->order.size() * sizeof progressive->order[0] +
                          progressive->faces.size() * sizeof progressive->faces[0] +
                          progressive->source_face.size() * sizeof progressive->source_face[0]) /
      static_cast<double>(progressive->points.size());

  refine::ActiveMesh active(*progressive);
  refine::Footprint footprint(*progressive);
  std::vector<double> refine_ms, query_ms;
  for (int ping = 0; ping < pings; ++ping) {
    const auto fans = fans_at(ping);
    start_s = thread_s();
    const refine::RefineStatistics did = active.refine(fans);
    const double ms = 1e3 * (thread_s() - start_s);
    start_s = thread_s();
    footprint.query(fans);
    query_ms.push_back(1e3 * (thread_s() - start_s));
    if (ping == 0) {
      result.first_ms = ms;
      continue;
    }
    refine_ms.push_back(ms);
    result.splits += static_cast<double>(did.splits) / (pings - 1);
    result.forced_splits += static_cast<double>(did.forced_splits) / (pings - 1);
    result.blocked_collapses += static_cast<double>(did.blocked_collapses) / (pings - 1);
    result.collapses += static_cast<double>(did.collapses) / (pings - 1);
  }
  result.refine_ms = spread_of(std::move(refine_ms));
  result.query_ms = spread_of(std::move(query_ms));
  result.active_vertices = active.vertex_count();
  result.active_faces = active.face_count();
  result.exact_faces = active.exact_faces().faces.size();
  refine::ActiveMesh fresh(*progressive);
  fresh.refine(fans_at(pings - 1));
  result.growth =
      static_cast<double>(active.vertex_count()) / static_cast<double>(fresh.vertex_count());
  return result;
}

}  // namespace

std::vector<RefinementMeasurement> measure_refinement(std::string_view filter) {
  std::vector<RefinementMeasurement> all;
  for (const auto& [size, faces] : {std::pair{"0.5M", 0.52e6}, std::pair{"2M", 2.09e6}})
    for (const bool reference : {false, true}) {
      const std::string name =
          fmt::format("refine/{}/fractal/{}", reference ? "openmesh" : "tiles", size);
      if (name.find(filter) != std::string::npos) all.push_back(measure_on(name, faces, reference));
    }
  return all;
}

}  // namespace ensonify::bench
