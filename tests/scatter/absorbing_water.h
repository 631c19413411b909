#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include <ensonify/scatter/sound_ray.h>
#include <ensonify/scatter/sound_speed_profile.h>

namespace ensonify::tests {

/// Water with these sound speeds and some absorption.
inline scatter::SoundSpeedProfile absorbing(std::vector<scatter::SoundSpeedSample> samples) {
  return scatter::SoundSpeedProfile(std::move(samples))
      .with_absorption(
          [](double depth_m, double mps) { return 1e-3 * (mps - 1400.0) + 1e-4 * depth_m; });
}

/// The exact arc of a launch down to a depth.
inline scatter::SoundRay arc(const scatter::SoundSpeedProfile& profile, double source_m,
                             double cotangent, double depth_m) {
  const double hypotenuse = std::hypot(1.0, cotangent);
  scatter::SoundRay ray(profile, source_m, cotangent / hypotenuse, 1.0 / hypotenuse, -1e9, depth_m);
  while (ray.reflections() == 0) ray.advance(ray.path_to_edge_m());
  return ray;
}

}  // namespace ensonify::tests
