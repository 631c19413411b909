#include <ensonify/scatter/buried_path.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <ensonify/scatter/reflection.h>

namespace ensonify::scatter {

BuriedPath buried_path(double height_m, double depth_m, double along_m, double sound_speed_ratio) {
  const double nu = sound_speed_ratio;
  BuriedPath path;
  const auto set = [&](double cosine) {
    path.cos_water = cosine;
    path.sin_water = std::sqrt(1.0 - cosine * cosine);
    path.cos_sediment = nu * cosine;
    path.sin_sediment = std::sqrt(1.0 - path.cos_sediment * path.cos_sediment);
  };
  // The distance that the path covers along the bed grows with the cosine, ever faster, and without
  // limit towards the critical angle. So Newton's method converges from above. If a step leaves the
  // bracket, the bracket is halved instead.
  constexpr int max_steps = 60;
  const double limit = std::min(1.0, 1.0 / nu);
  double low = 0.0, high = limit;
  double cosine = std::min(along_m / std::hypot(along_m, height_m + depth_m), 0.999 * limit);
  for (int step = 0; step < max_steps; ++step) {
    set(cosine);
    const double reached_m = height_m * path.cos_water / path.sin_water +
                             depth_m * path.cos_sediment / path.sin_sediment;
    const double over_m = reached_m - along_m;
    if (std::abs(over_m) <= 1e-9 * (height_m + along_m)) break;
    (over_m > 0.0 ? high : low) = cosine;
    const double slope_m =
        height_m / (path.sin_water * path.sin_water * path.sin_water) +
        nu * depth_m / (path.sin_sediment * path.sin_sediment * path.sin_sediment);
    cosine -= over_m / slope_m;
    if (!(cosine > low && cosine < high)) cosine = 0.5 * (low + high);
  }
  path.water_m = height_m / path.sin_water;
  path.sediment_m = depth_m / path.sin_sediment;
  const double a = path.water_m + nu * path.sediment_m;
  const double b = path.water_m / (path.sin_water * path.sin_water) +
                   nu * path.sediment_m / (path.sin_sediment * path.sin_sediment);
  path.spreading_m2 = path.sin_water * path.sin_sediment * a * b / nu;
  return path;
}

double two_way_attenuation_per_m(const Sediment& sediment, double wavelength_m) {
  return 8.0 * std::numbers::pi / wavelength_m * sediment.loss / sediment.sound_speed_ratio;
}

double buried_gain(const BuriedPath& path, const Sediment& sediment, double wavelength_m) {
  const double through =
      1.0 - std::norm(reflection_coefficient(sediment, std::asin(path.sin_water)));
  return through * through *
         std::exp(-two_way_attenuation_per_m(sediment, wavelength_m) * path.sediment_m);
}

}  // namespace ensonify::scatter
