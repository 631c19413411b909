#include "scenes.h"

#include <array>
#include <cmath>

namespace ensonify::bench {
namespace {

using engine::Scene;
namespace fs = std::filesystem;

/// Sets the rays that all cells are timed with, and switches random parts off.
Scene bare(Scene scene) {
  engine::Sonar& sonar = scene.sonars.front();
  sonar.focused = true;  // otherwise its near field needs more planes
  sonar.elevations = 4096;
  scene.speckle = false;
  return scene;
}

std::optional<Scene> smooth(double faces, const fs::path&) { return bare(fractal(faces)); }
std::optional<Scene> rippled(double faces, const fs::path&) { return bare(ripples(faces)); }

std::optional<Scene> cluttered(double faces, const fs::path&) {
  Scene scene = bare(fractal(faces));
  scene.objects.push_back({.shape = "sphere",
                           .size = {.diameter_m = 1.0},
                           .east_m = 0.0,
                           .north_m = 0.0,
                           .height_m = 0.5,
                           .count = 400,
                           .area_radius_m = 60.0,
                           .scale_min = 0.5,
                           .scale_max = 2.0});
  return scene;
}

std::optional<Scene> wreck(double faces, const fs::path& data) {
  const fs::path mesh = data / "mesh_underwater/skytteren_wreck.ply";
  if (!fs::exists(mesh)) return std::nullopt;
  Scene scene = bare(fractal(faces));
  scene.seafloor.depth_m = 90.0;
  scene.objects.push_back({.mesh = {"wreck.ply", mesh}, .class_name = "wreck", .north_m = 60.0});
  scene.track.heading_rad = 1.5707963267948966;
  scene.track.middle_north_m = -20.0;
  scene.track.altitude_m = 45.0;
  scene.sonars.front().range_m = 180.0;
  return scene;
}

std::optional<Scene> survey(double faces, const fs::path& data) {
  const fs::path grid = data / "bathymetry/portsmouth_tiny_0.5m.bag";
  if (!fs::exists(grid)) return std::nullopt;
  constexpr double extent_m2 = 58.0 * 43.0, cell_m = 0.5;
  Scene scene = bare({});
  scene.seafloor.kind = engine::SeafloorKind::survey;
  scene.seafloor.survey = {"survey.bag", grid};
  scene.seafloor.detail.cell_m = cell_m / std::round(cell_m / std::sqrt(2.0 * extent_m2 / faces));
  scene.track.heading_rad = 1.5707963267948966;
  scene.track.altitude_m = 6.0;
  scene.sonars.front().range_m = 25.0;
  return scene;
}

constexpr std::array all_beds{
    Bed{"smooth", "a fractal bed of 500 x 500 m, 15 m below", &smooth},
    Bed{"rippled", "sand ripples, 200 x 200 m, 10 m below", &rippled},
    Bed{"cluttered", "the smooth bed with 400 spheres on and over it", &cluttered},
    Bed{"wreck", "a ship of 176 m on a smooth bed, 45 m below", &wreck},
    Bed{"survey", "a survey of 58 x 43 m with relief below its cells, 6 m below", &survey},
};

}  // namespace

Scene ripples(double faces) {
  constexpr double extent_m = 200.0;
  Scene scene;
  scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = extent_m;
  scene.seafloor.cell_m = extent_m / std::round(std::sqrt(faces / 2.0));
  scene.seafloor.depth_m = 25.0;
  scene.seafloor.ripples.rms_height_m = 0.05;
  scene.seafloor.ripples.wavelength_m = 2.0;
  scene.track.altitude_m = 10.0;
  scene.sonars.front().elevations = 4096;
  return scene;
}

Scene fractal(double faces) {
  constexpr double extent_m = 500.0;
  Scene scene;
  scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = extent_m;
  scene.seafloor.cell_m = extent_m / std::round(std::sqrt(faces / 2.0));
  scene.seafloor.depth_m = 40.0;
  scene.track.altitude_m = 15.0;
  scene.sonars.front().elevations = 4096;
  return scene;
}

const std::string_view target_recipe =
#include "target_recipe.inc"
    ;

std::span<const Bed> beds() { return all_beds; }

}  // namespace ensonify::bench
