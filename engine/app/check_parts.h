#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/trace/check/agreement.h>
#include <ensonify/engine/trace/check/limits.h>

// Parts of `ensonify check`: its pings and its report.

namespace ensonify::engine::app {

/// Blocks of pings as in a run, spread over the track, with at least `rays` rays. A block has so
/// many pings that a tree for several pings is built, used and built again. If the track has too
/// few pings, it is repeated with sonars that are turned slightly.
std::vector<PingBlock> scene_blocks(const Scene& scene, Simulator& simulator, std::uint64_t rays);

std::size_t pings_of(const std::vector<PingBlock>& blocks);
/// The number of rays of these blocks within their beams.
std::uint64_t rays_of(const std::vector<PingBlock>& blocks);

/// The table of a comparison as CSV.
std::string csv(const std::vector<AgreementRow>& rows);
nlohmann::ordered_json to_json(const AgreementRow& row);

/// One line per exceeded limit: "over the limit: static embree scene: tie 0.012 of the rays, ...".
std::string report_limits(const std::vector<AgreementRow>& rows);

/// Prints to stderr what is needed to reproduce each difference. `ensonify seafloor` writes the
/// mesh, and `ensonify trace` traces the ray if it is straight. For a bent ray, the direction in
/// which it starts is printed.
void print_unexplained(const AgreementRow& row, const Eigen::Vector3d& world_origin);

}  // namespace ensonify::engine::app
