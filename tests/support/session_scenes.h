#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

#include "support/beds.h"
#include "support/files.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/refine/mesh_reader.h>

namespace ensonify::tests {

using namespace engine;

constexpr double infinity = std::numeric_limits<double>::infinity();

inline Scene bare_scene() {
  Scene scene;
  scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = 50.0;
  scene.seafloor.cell_m = 0.5;
  scene.seafloor.depth_m = 15.0;
  scene.sonars.front().range_m = 25.0;
  scene.sonars.front().bins = 200;
  scene.sonars.front().elevations = 400;
  scene.run.surface = "static";
  return scene;
}

/// bare_scene() in water where sound is faster near the bed.
inline Scene bent_scene(const TemporaryFolder& folder) {
  write_text(folder / "cast.csv", "depth_m,soundspeed_mps\n0,1504\n4,1505\n18,1510\n33,1511\n");
  Scene scene = bare_scene();
  scene.sea.profile = {"cast.csv", folder / "cast.csv"};
  scene.sea.refraction = RefractionMode::full;
  return scene;
}

inline Scene with_box(Scene scene, const TemporaryFolder& folder) {
  Seafloor holder;
  add_box(holder, {0, 0, 0}, {4, 2, 3});
  refine::write_ply(folder / "box.ply", holder.mesh);
  scene.objects.push_back({.mesh = {"box.ply", folder / "box.ply"},
                           .class_name = "box",
                           .material = "wood",
                           .east_m = 12.0,
                           .north_m = 0.0,
                           .heading_rad = 0.4});
  return scene;
}

/// The one object of a scene, in local metres.
inline refine::TriangleMesh object_of(const Simulator& simulator) {
  const refine::TriangleMesh& all = simulator.seafloor().mesh;
  refine::TriangleMesh mesh{.positions = all.positions};
  mesh.faces.assign(all.faces.begin() + static_cast<std::ptrdiff_t>(simulator.seafloor().bed_faces),
                    all.faces.end());
  return mesh;
}

inline const Pose beside{.position = {0.0, 0.0, -7.0}, .roll_rad = 0.02, .heading_rad = 0.1};

/// All numbers of all lines, in order.
inline std::vector<double> numbers(std::span<const EchoLine> lines) {
  std::vector<double> all;
  for (const EchoLine& line : lines)
    BinLayers::for_each([&](std::string_view, auto layer) {
      all.insert(all.end(), (line.bins.*layer).begin(), (line.bins.*layer).end());
    });
  return all;
}

inline std::size_t bins_of(std::span<const EchoLine> lines, std::uint32_t instance) {
  std::size_t count = 0;
  for (const EchoLine& line : lines) count += std::ranges::count(line.bins.instance, instance);
  return count;
}

inline refine::TriangleMesh cube(float half_m) {
  Seafloor holder;
  add_box(holder, {-half_m, -half_m, -half_m}, {half_m, half_m, half_m});
  return holder.mesh;
}

}  // namespace ensonify::tests
