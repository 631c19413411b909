#pragma once

#include <cmath>
#include <span>
#include <vector>

#include <ensonify/engine/sonar/reception/signal_chain.h>

namespace ensonify::tests {

/// The expected echo line of a sector over a level bed of uniform strength, computed without rays:
/// places in the plane abeam of an array that heads north, an expected intensity of 1 from the
/// first return on.
inline engine::EchoLine level_line(const engine::Sonar& sonar, const engine::Sector& sector,
                                   const Eigen::Vector3d& array, double altitude_m) {
  engine::EchoLine line;
  line.sector = sonar.sides == engine::Sides::both ? sector.number : 0;
  line.bins.assign(static_cast<std::size_t>(sonar.bins));
  for (std::size_t i = 0; i < line.bins.range_m.size(); ++i) {
    const double r = (static_cast<double>(i) + 0.5) * sonar.bin_m();
    line.bins.range_m[i] = static_cast<float>(r);
    line.bins.region[i] = static_cast<std::uint32_t>(engine::Region::water_column);
    if (r < altitude_m) continue;
    if (line.first_return < 0) line.first_return = static_cast<int>(i);
    const double over_m = std::sqrt(r * r - altitude_m * altitude_m);
    line.bins.intensity_mean[i] = 1.0f;
    line.bins.region[i] = static_cast<std::uint32_t>(engine::Region::seabed);
    line.bins.x_m[i] = static_cast<float>(array.x() + sector.out * over_m);
    line.bins.y_m[i] = static_cast<float>(array.y());
    line.bins.z_m[i] = static_cast<float>(array.z() - altitude_m);
  }
  return line;
}

/// Receives lines of one ping together, all with the same context.
inline void receive_lines(const engine::SignalChain& chain, const engine::LineContext& context,
                          std::span<engine::EchoLine> lines,
                          engine::SignalChain::Scratch& scratch) {
  const std::vector<engine::LineContext> contexts(lines.size(), context);
  chain.receive(contexts, lines, scratch);
}

/// A sonar without noise.
inline engine::Sonar quiet_sonar() {
  engine::Sonar sonar;
  sonar.receiver.noise = false;
  return sonar;
}

}  // namespace ensonify::tests
