#include <cmath>

#include "support/catch.h"

#include <ensonify/scatter/buried_path.h>
#include <ensonify/scatter/eigenray.h>

using namespace ensonify::scatter;

TEST_CASE("in one medium the buried path is straight and spreads to its length squared") {
  for (const double along_m : {0.0, 0.3, 5.0, 60.0}) {
    const BuriedPath path = buried_path(10.0, 0.5, along_m, 1.0);
    const double straight_m = std::hypot(along_m, 10.5);
    CHECK(path.water_m + path.sediment_m == Approx(straight_m).epsilon(1e-8));
    CHECK(path.spreading_m2 == Approx(straight_m * straight_m).epsilon(1e-7));
    CHECK(path.sin_water == Approx(10.5 / straight_m).epsilon(1e-8));
  }
}

TEST_CASE("the buried path is the ray through two layers, in length, angle and spreading") {
  // The layers of the profile meet within 2 mm, less than which a profile merges.
  constexpr double height_m = 10.0, water_mps = 1500.0;
  for (const double nu : {0.98, 1.018, 1.18})
    for (const double depth_m : {0.2, 0.6, 2.0})
      for (const double along_m : {1.0, 8.0, 14.0}) {
        const SoundSpeedProfile profile({{0.0, water_mps},
                                         {height_m - 1e-3, water_mps},
                                         {height_m + 1e-3, nu * water_mps},
                                         {height_m + 10.0, nu * water_mps}});
        SoundRay ray =
            find_eigenray(profile, {.range_m = along_m, .depth_m = height_m + depth_m}).value();
        const double sine = ray.point().down;
        while (ray.path_to_range_m(along_m) > ray.path_to_edge_m())
          ray.advance(ray.path_to_edge_m());
        ray.advance(ray.path_to_range_m(along_m));
        const BuriedPath path = buried_path(height_m, depth_m, along_m, nu);
        CAPTURE(nu, depth_m, along_m);
        CHECK(path.sin_water == Approx(sine).epsilon(1e-3));
        CHECK(path.sin_sediment == Approx(ray.point().down).epsilon(1e-3));
        CHECK(path.water_m + path.sediment_m == Approx(ray.point().path_m).epsilon(1e-4));
        CHECK(path.spreading_m2 * path.spreading_m2 ==
              Approx(ray.spreading_m2() * ray.spreading_back_m2()).epsilon(5e-3));
      }
}

TEST_CASE("far away the path into a fast bed comes near the critical angle, and is found") {
  const double nu = 1.18, critical = 1.0 / nu;
  for (const double along_m : {30.0, 300.0, 3000.0}) {
    const BuriedPath path = buried_path(5.0, 0.2, along_m, nu);
    CAPTURE(along_m);
    CHECK(path.cos_water < critical);
    CHECK(path.cos_sediment == Approx(nu * path.cos_water).epsilon(1e-12));
    CHECK(path.water_m * path.cos_water + path.sediment_m * path.cos_sediment ==
          Approx(along_m).epsilon(1e-6));
  }
}

TEST_CASE("a buried echo loses the reflected part twice, and twice the sediment's attenuation") {
  // Straight down, R = (rho nu - 1) / (rho nu + 1) without loss; alpha = 54.575 delta dB per
  // wavelength in the sediment (TR 9407 eq. 31).
  Sediment mud = sediment_named("coarse silt");
  constexpr double wavelength_m = 0.03, depth_m = 0.2;
  const BuriedPath path = buried_path(10.0, depth_m, 0.0, mud.sound_speed_ratio);
  const double impedance = mud.density_ratio * mud.sound_speed_ratio;
  const double R = (impedance - 1.0) / (impedance + 1.0);
  const double per_m_db = 54.575 * mud.loss / (mud.sound_speed_ratio * wavelength_m);
  CHECK(-10.0 * std::log10(buried_gain(path, mud, wavelength_m)) ==
        Approx(2.0 * per_m_db * depth_m - 20.0 * std::log10(1.0 - R * R)).margin(0.01));
}
