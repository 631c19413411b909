#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <vector>

#include "support/beds.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/sea_water.h>
#include <ensonify/scatter/sound_speed_profile.h>

namespace ensonify::tests {

using namespace engine;

inline constexpr double bed_m = 22.0;

/// Water with one temperature above 8 m and another below 12 m, and a cast through it.
struct Sea2 {
  double warm_c = 20.0, cold_c = 4.0;

  scatter::SeaWater water(double depth_m) const {
    const double share = std::clamp((depth_m - 8.0) / 4.0, 0.0, 1.0);
    return {.temperature_c = warm_c + share * (cold_c - warm_c)};
  }
  double speed_mps(double depth_m) const {
    return scatter::sound_speed_mps(water(depth_m), depth_m);
  }
  double absorption_db_per_m(double depth_m, double frequency_hz) const {
    return scatter::absorption_db_per_m(water(depth_m), depth_m, frequency_hz);
  }
  scatter::SoundSpeedProfile profile() const {
    std::vector<scatter::SoundSpeedSample> samples;
    for (double z = 0.0; z <= 30.0; z += 0.25) samples.push_back({z, speed_mps(z)});
    return scatter::SoundSpeedProfile(std::move(samples));
  }
  InputFile cast(const TemporaryFolder& folder) const {
    std::ofstream file(folder / "cast.csv");
    file.precision(12);
    file << "depth_m,soundspeed_mps\n";
    for (double z = 0.0; z <= 30.0; z += 0.25) file << z << ',' << speed_mps(z) << '\n';
    return {"cast.csv", folder / "cast.csv"};
  }
};

inline Scene level_scene() {
  Scene scene;
  scene.seafloor.fractal.height_at_1m_m = 0.0;
  scene.seafloor.depth_m = bed_m;
  scene.seafloor.extent_east_m = 240.0;
  scene.seafloor.extent_north_m = 60.0;
  scene.seafloor.cell_m = 0.5;
  scene.seafloor.material = "shells";  // Lambert's law
  scene.speckle = false;
  scene.sonars.front() = plain_sonar();
  scene.sonars.front().range_m = 100.0;
  return scene;
}

/// A smooth steel ball that a few planes of the fan meet.
inline ObjectOptions small_ball(double east_m, double height_m) {
  ObjectOptions ball{.shape = "sphere", .material = "steel"};
  ball.size.diameter_m = 0.3;
  ball.east_m = east_m;
  ball.height_m = height_m;
  return ball;
}

/// The range of the strongest echo, and the energy around that range. If the bed is dark, this is
/// the energy of the only object.
struct Peak {
  double range_m, energy_db;
};
inline Peak peak_of(const Scene& scene, double depth_m) {
  constexpr double reach_m = 0.5;
  Simulator simulator(scene);
  const EchoLine line = simulator.ping_numbered({.position = {0.0, 0.0, -depth_m}}, 0)[1];
  const std::vector<float>& all = line.bins.intensity_mean;
  const auto at = static_cast<std::size_t>(std::ranges::max_element(all) - all.begin());
  Peak peak{double(line.bins.range_m[at]), 0.0};
  double energy = 0.0;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (std::abs(double(line.bins.range_m[i]) - peak.range_m) < reach_m) energy += double(all[i]);
  peak.energy_db = scatter::to_db(energy);
  return peak;
}

/// A level bed that returns next to nothing.
inline Scene dark_scene() {
  Scene scene = level_scene();
  Material dark{.name = "dark", .model = "lambert"};
  dark.lambert_mu_db = -100.0;
  scene.materials = {dark};
  scene.seafloor.material = "dark";
  scene.sonars.front().sector_low_rad = -0.6;
  return scene;
}

inline std::vector<double> level_db(const Scene& scene, double depth_m) {
  Simulator simulator(scene);
  std::vector<double> all;
  for (const float intensity :
       simulator.ping_numbered({.position = {0.0, 0.0, -depth_m}}, 0)[1].bins.intensity_mean)
    all.push_back(scatter::to_db(std::max(double(intensity), 1e-30)));
  return all;
}

}  // namespace ensonify::tests
