#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/simulate.h>

namespace ensonify::engine {

/// What all pings of a scene gave.
struct ScenePings {
  std::vector<Waterfall> images;                      ///< one a sonar
  std::vector<std::vector<ObjectView>> object_views;  ///< by sonar, as Simulator::object_views()
  std::uint64_t rays = 0, hits = 0;
  RefractionCounts refraction;
  StageTimes stages;                  ///< summed over threads
  std::vector<std::string> warnings;  ///< of the track
};

/// Called after every block, by one thread while all others wait; what it throws ends the pings.
using AfterBlock =
    std::function<void(std::span<const Waterfall> images, std::size_t pings, std::size_t of)>;

/// Every ping of a scene's track, in aligned blocks over threads (0: as many as the machine has), by
/// simulators over the seafloor of this one. Throws SceneError for a track that leaves the seafloor, and
/// as Simulator::ping().
ScenePings ping_all(const Scene& scene, Simulator& simulator, int threads,
                    const AfterBlock& after_block = {});

}  // namespace ensonify::engine
