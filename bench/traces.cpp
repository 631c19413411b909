#include "traces.h"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/internals.h>
#include <ensonify/engine/trace/embree/embree.h>
#include <ensonify/engine/trace/face_sources/exact_faces.h>
#include <ensonify/engine/trace/fan_scan/fan_scan.h>
#include <ensonify/refine/footprint.h>
#include <ensonify/refine/parallel_for.h>

#include "bare_embree.h"
#include "clock.h"
#include "scenes.h"

namespace ensonify::bench {
namespace {

struct Row {
  std::string name;
  std::unique_ptr<engine::Intersector> (*make)(const engine::IntersectorOptions& options);
  engine::IntersectorOptions options;
  // Traces the faces that the pair of fans can touch, found for each pair.
  bool on_footprint = false;
};

/// The first row is the bare loop, which ratios refer to.
std::vector<Row> rows() {
  std::vector<Row> all{{"bare embree", make_bare_embree, {}},
                       {"embree", engine::make_embree, {}},
                       {"embree fast", engine::make_embree, {.robust = false}},
                       {"embree-single", engine::make_embree_single, {}},
                       {"footprint/fan_scan", engine::make_fan_scan, {}, true}};
  for (const std::string_view set : engine::instruction_sets())
    if (set == "avx512") {
      all.push_back({"bare embree avx512", make_bare_embree, {.instruction_set = "avx512"}});
      all.push_back({"embree avx512", engine::make_embree, {.instruction_set = "avx512"}});
    }
  return all;
}

std::vector<engine::RayFan> fans_over(engine::Simulator& simulator) {
  std::vector<engine::RayFan> fans;
  for (const engine::Pose& pose : simulator.track())
    for (const engine::RayFan& fan : engine::SimulatorInternals::aim(simulator, pose))
      fans.push_back(fan);
  return fans;
}

std::vector<TraceMeasurement> measure_over(const std::string& bed, engine::Scene scene,
                                           std::string_view filter, int rounds, int pings) {
  std::vector<Row> wanted = rows();
  std::erase_if(wanted,
                [&](const Row& row) { return (bed + row.name).find(filter) == std::string::npos; });
  if (wanted.empty()) return {};
  if (Row bare = rows().front(); wanted.front().name != bare.name)
    wanted.insert(wanted.begin(), std::move(bare));
  scene.track.pings = pings;
  scene.run.surface = "static";  // with a mesh of the bed
  engine::Simulator simulator(scene);
  const std::vector<engine::RayFan> fans = fans_over(simulator);
  std::vector<engine::Hit> hits(fans.front().grid->rays());
  const auto rays_of = [](const engine::RayFan& fan) {
    std::size_t rays = 0;
    for (std::size_t plane = 0; plane < fan.planes(); ++plane)
      for (std::size_t j = 0; j < fan.elevations(); ++j) rays += fan.grid->within_beam(plane, j);
    return rays;
  };

  const refine::TriangleMesh& mesh = simulator.seafloor().mesh;
  std::shared_ptr<const refine::ProgressiveMesh> progressive;
  std::unique_ptr<refine::Footprint> footprint;
  std::vector<TraceMeasurement> results;
  std::vector<std::unique_ptr<engine::Intersector>> tracers;
  for (const Row& row : wanted) {
    tracers.push_back(row.make(row.options));
    const double start_s = wall_s();
    if (row.on_footprint) {
      progressive = engine::make_progressive_mesh(mesh, refine::thread_count(0));
      footprint = std::make_unique<refine::Footprint>(*progressive);
    } else {
      tracers.back()->build(mesh);
    }
    results.push_back({.name = bed + row.name,
                       .code_path = std::string(tracers.back()->code_path()),
                       .faces = mesh.faces.size(),
                       .rays = static_cast<double>(rays_of(fans[0]) + rays_of(fans[1])),
                       .build_ms = 1e3 * (wall_s() - start_s)});
    tracers.back()->intersect(fans.front(), hits);  // warms up
  }
  // The tracers alternate with each pair of fans, so that a change of the machine's speed affects
  // all equally. Thread time excludes other programs.
  std::vector<std::vector<double>> pair_us(tracers.size()), ratio(tracers.size()),
      query_us(tracers.size()), take_us(tracers.size());
  for (int round = 0; round < rounds; ++round)
    for (std::size_t fan = 0; fan < fans.size(); fan += 2)
      for (std::size_t i = 0; i < tracers.size(); ++i) {
        if (wanted[i].on_footprint) {
          const double query_s = thread_s();
          const refine::ExactFaces exact = footprint->query(
              std::array{engine::fan_volume_of(fans[fan]), engine::fan_volume_of(fans[fan + 1])});
          const double take_s = thread_s();
          tracers[i]->build({exact.points, exact.faces, exact.source_faces});
          take_us[i].push_back(1e6 * (thread_s() - take_s));
          query_us[i].push_back(1e6 * (take_s - query_s));
          results[i].faces = exact.faces.size();
        }
        const double start_s = thread_s();
        tracers[i]->intersect(fans[fan], hits);
        tracers[i]->intersect(fans[fan + 1], hits);
        pair_us[i].push_back(1e6 * (thread_s() - start_s));
        ratio[i].push_back(pair_us[i].back() / pair_us.front().back());
      }
  for (std::size_t i = 0; i < tracers.size(); ++i) {
    results[i].pair_us = spread_of(pair_us[i]);
    results[i].ratio = spread_of(ratio[i]).median;
    results[i].query_us = spread_of(query_us[i]);
    results[i].take_us = spread_of(take_us[i]);
  }
  return results;
}

}  // namespace

std::vector<TraceMeasurement> measure_traces(std::string_view filter,
                                             const std::filesystem::path& data, int rounds,
                                             int pings) {
  std::vector<TraceMeasurement> all;
  for (const Bed& bed : beds())
    for (const Size& size : sizes) {
      const std::string name = fmt::format("trace/{}/{}/", bed.name, size.name);
      const bool large = size.faces > 4e6;  // measured only if the filter contains the size
      if (large && filter.find(size.name) == std::string_view::npos) continue;
      const std::optional<engine::Scene> scene = bed.scene(size.faces, data);
      if (!scene) continue;
      for (TraceMeasurement& one : measure_over(name, *scene, filter, rounds, pings))
        all.push_back(std::move(one));
    }
  return all;
}

}  // namespace ensonify::bench
