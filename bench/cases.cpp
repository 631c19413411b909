#include "cases.h"

#include <cmath>

namespace ensonify::bench {
engine::Scene ripples(double faces) {
  constexpr double extent_m = 200.0;
  engine::Scene scene;
  scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = extent_m;
  scene.seafloor.cell_m = extent_m / std::round(std::sqrt(faces / 2.0));
  scene.seafloor.depth_m = 25.0;
  scene.seafloor.ripples.rms_height_m = 0.05;
  scene.seafloor.ripples.wavelength_m = 2.0;
  scene.track.altitude_m = 10.0;
  scene.sonars.front().elevations = 4096;
  return scene;
}

engine::Scene fractal(double faces) {
  constexpr double extent_m = 500.0;
  engine::Scene scene;
  scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = extent_m;
  scene.seafloor.cell_m = extent_m / std::round(std::sqrt(faces / 2.0));
  scene.seafloor.depth_m = 40.0;
  scene.track.altitude_m = 15.0;
  scene.sonars.front().elevations = 4096;
  return scene;
}

std::vector<Case> all_cases() {
  std::vector<Case> cases;
  for (const auto& [size, faces] : {std::pair{"0.5M", 0.5e6}, std::pair{"2M", 2e6}})
    for (const char* intersector : {"embree", "fan_scan"})
      for (const char* surface : {"static", "refined", "footprint"}) {
        Case& one = cases.emplace_back();
        one.name = std::string("ripples/") + size + "/" + surface + "/" + intersector;
        one.scene = ripples(faces);
        one.scene.run.surface = surface;
        one.scene.run.intersector = intersector;
      }
  return cases;
}

}  // namespace ensonify::bench
