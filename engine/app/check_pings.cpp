#include "check_parts.h"

#include <algorithm>
#include <array>
#include <stdexcept>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/simulator/internals.h>

namespace ensonify::engine::app {

std::vector<PingBlock> scene_blocks(const Scene& scene, Simulator& simulator, std::uint64_t rays) {
  const std::vector<Pose> track = simulator.track();
  const auto fans_at = [&](const Pose& pose) {
    const std::span<const RayFan> fans = SimulatorInternals::aim(simulator, pose);
    return std::vector<RayFan>(fans.begin(), fans.end());
  };
  std::uint64_t a_ping = 0;
  for (const RayFan& fan : fans_at(track[track.size() / 2])) a_ping += rays_within_beam(*fan.grid);
  const std::uint64_t wanted = rays / std::max<std::uint64_t>(a_ping, 1) + 1;
  const std::size_t length =
      std::min(track.size(), static_cast<std::size_t>(scene.run.tree_pings) + 2);
  const std::size_t count = (wanted + length - 1) / length, a_pass = track.size() / length;
  std::vector<PingBlock> blocks(count);
  for (std::size_t b = 0; b < count; ++b) {
    const std::size_t pass = b / a_pass, first = pass * a_pass;
    const std::size_t of = std::min(count - first, a_pass);
    const std::size_t begin = (b - first) * (track.size() - length) / std::max<std::size_t>(of, 1);
    std::array<double, 3> turn{};
    if (pass > 0) RandomStream(scene.seed, Purpose::agreement, {2, pass, 0}).normal(turn);
    for (std::size_t ping = begin; ping < begin + length; ++ping) {
      Pose pose = track[ping];
      pose.roll_rad += 0.05 * turn[0];
      pose.pitch_rad += 0.05 * turn[1];
      pose.heading_rad += 0.05 * turn[2];
      try {
        blocks[b].push_back(fans_at(pose));
      } catch (const std::invalid_argument&) {  // the turned vehicle has a sonar out of the water
        blocks[b].push_back(fans_at(track[ping]));
      }
    }
  }
  return blocks;
}

std::size_t pings_of(const std::vector<PingBlock>& blocks) {
  std::size_t pings = 0;
  for (const PingBlock& block : blocks) pings += block.size();
  return pings;
}

std::uint64_t rays_of(const std::vector<PingBlock>& blocks) {
  std::uint64_t rays = 0;
  for (const PingBlock& block : blocks)
    for (const std::vector<RayFan>& ping : block)
      for (const RayFan& fan : ping) rays += rays_within_beam(*fan.grid);
  return rays;
}

}  // namespace ensonify::engine::app
