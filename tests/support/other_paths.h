#pragma once

#include <algorithm>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "support/lines.h"

namespace ensonify::tests {

// A sonar over a level bed, and what it receives in addition to the direct echo.

inline constexpr double altitude_m = 10.0, depth_m = 14.0;
inline const Eigen::Vector3d array{0.0, 0.0, -depth_m};
inline const engine::LineContext context{
    .ping = 3, .array = {array, {0, 1, 0}}, .altitude_m = altitude_m};

inline engine::Sonar open_sonar() {  // has the same gain in all vertical directions
  engine::Sonar sonar = quiet_sonar();
  sonar.focused = true;
  sonar.vertical.beamwidth_rad = 0.0;
  return sonar;
}

/// The mean intensity of a ping with these other paths, over a bed with the direct echo `direct`.
struct Circumstances {
  engine::Sector sector = engine::starboard_sector;
  engine::ArrayFrame array_frame = context.array;
  engine::Pose motion = {};  // its rates
  engine::ArtefactOptions artefacts = {};
  std::optional<scatter::Sediment> bed = {};
  std::function<double(double sine)> strength = [](double) { return 3e-4; };
  double ping_interval_s = 0.0;
};
inline std::vector<double> received(const engine::Sonar& sonar,
                                    const engine::OtherPathsOptions& arrivals,
                                    const std::vector<float>& direct = {},
                                    const engine::SeaState& sea = {},
                                    const Circumstances& under = {}) {
  const engine::SignalChain chain(sonar, {.speckle = false,
                                          .absorption_db_per_m = 0.03,
                                          .ping_interval_s = under.ping_interval_s,
                                          .nominal_strength = under.strength,
                                          .bed = under.bed,
                                          .sea = sea,
                                          .arrivals = arrivals,
                                          .artefacts = under.artefacts});
  engine::EchoLine line = level_line(sonar, under.sector, array, altitude_m);
  std::fill(line.bins.intensity_mean.begin(), line.bins.intensity_mean.end(), 0.0f);
  std::copy(direct.begin(), direct.end(), line.bins.intensity_mean.begin());
  engine::SignalChain::Scratch scratch;
  engine::LineContext now = context;
  now.array = under.array_frame;
  now.motion = engine::receiver_motion(under.motion, under.sector, sonar.range_m, 1500.0);
  receive_lines(chain, now, std::span(&line, 1), scratch);
  return {line.bins.intensity.begin(), line.bins.intensity.end()};
}

}  // namespace ensonify::tests
