#pragma once

#include <cstdint>
#include <vector>

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/trace/check/agreement.h>

namespace ensonify::engine::app {

/// Blocks of pings as in a run, with at least `rays` rays, spread over the track. A block is long
/// enough for a tree that serves several pings to be built, used and built again. If the track has
/// too few pings, it is repeated with slightly turned sonars.
std::vector<PingBlock> scene_blocks(const Scene& scene, Simulator& simulator, std::uint64_t rays);

std::size_t pings_of(const std::vector<PingBlock>& blocks);
/// The number of rays of these blocks within their beams.
std::uint64_t rays_of(const std::vector<PingBlock>& blocks);

}  // namespace ensonify::engine::app
