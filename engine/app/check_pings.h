#pragma once

#include <cstdint>
#include <vector>

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/trace/check/agreement.h>

namespace ensonify::engine::app {

/// Blocks of pings as in a run, spread over the track, with at least `rays` rays. A block has so
/// many pings that a tree for several pings is built, used and built again. If the track has too
/// few pings, it is repeated with sonars that are turned slightly.
std::vector<PingBlock> scene_blocks(const Scene& scene, Simulator& simulator, std::uint64_t rays);

std::size_t pings_of(const std::vector<PingBlock>& blocks);
/// The number of rays of these blocks within their beams.
std::uint64_t rays_of(const std::vector<PingBlock>& blocks);

}  // namespace ensonify::engine::app
