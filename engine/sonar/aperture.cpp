#include <ensonify/engine/sonar/aperture.h>

#include <algorithm>
#include <cmath>

namespace ensonify::engine {

Aperture make_aperture(const Sonar& sonar, double wavelength_m, double range_over_height,
                       double lean_rad) {
  const LineArray array{sonar.array_length_m, wavelength_m};
  auto grid = std::make_shared<const FanGrid>(FanLayout{
      .sector_low_rad = sonar.sector_low_rad,
      .sector_high_rad = sonar.sector_high_rad,
      .truncation_rad = array.first_null_rad(),
      .main_lobe_rad = array.first_null_rad(),
      .planes = sonar.planes,
      .elevations = sonar.elevations,
      .range_over_height = range_over_height,
      .lean_rad = lean_rad,
  });

  std::vector<float> weight(grid->rays());
  const double cos_middle = std::cos(grid->middle_depression_rad);
  const double sin_middle = std::sin(grid->middle_depression_rad);
  for (std::size_t k = 0; k < grid->planes.size(); ++k) {
    const FanGrid::Plane& plane = grid->planes[k];
    for (std::size_t j = 0; j < grid->elevation_rad.size(); ++j) {
      if (!grid->within_beam(k, j)) continue;
      const double towards_middle = grid->cos_elevation[j] * plane.cos_azimuth;
      const double towards_pole = grid->sin_elevation[j];
      const double out = towards_middle * cos_middle + towards_pole * sin_middle;
      const double down = towards_middle * sin_middle - towards_pole * cos_middle;
      const double one_way = array.power(grid->cos_elevation[j] * plane.sin_azimuth) *
                             sonar.vertical.power(std::atan2(down, out));
      weight[k * grid->elevation_rad.size() + j] =
          static_cast<float>(one_way * one_way * grid->cos_elevation[j] * plane.width_rad);
    }
  }
  return {std::move(grid), std::move(weight)};
}

double trace_range_m(const Sonar& sonar, double sound_speed_mps) {
  const double cell_m = 0.5 * sound_speed_mps / sonar.bandwidth_hz;
  return sonar.range_m + std::max(cell_m + 2.0 * sonar.bin_m(), 0.01 * sonar.range_m);
}

double lean_rad(const Pose& pose, Side side) {
  const Eigen::Matrix3d body = body_to_world(pose);
  const double out = side == Side::starboard ? body(2, 1) : -body(2, 1);
  return std::atan2(-out, -body(2, 2));
}

RayFan place_fan(const Aperture& aperture, const Pose& pose, Side side, double range_m) {
  const Eigen::Matrix3d body = body_to_world(pose);
  const Eigen::Vector3d abeam =
      side == Side::starboard ? body.col(1) : Eigen::Vector3d(-body.col(1));
  const Eigen::Vector3d down = body.col(2);
  const double c = std::cos(aperture.grid->middle_depression_rad);
  const double s = std::sin(aperture.grid->middle_depression_rad);
  return {aperture.grid,        pose.position,        body.col(0),
          c * abeam + s * down, s * abeam - c * down, range_m};
}

const Aperture& Apertures::at(double altitude_m, double lean_rad) {
  constexpr double steps_per_octave = 4.0;
  constexpr double lean_step_rad = 0.008726646259971648;  // half a degree
  const double lowest_m = 1e-3 * sonar_.range_m;
  const int step =
      static_cast<int>(std::floor(steps_per_octave * std::log2(std::max(altitude_m, lowest_m))));
  const int lean_step = static_cast<int>(std::lround(lean_rad / lean_step_rad));
  auto found = made_.find({step, lean_step});
  if (found == made_.end()) {
    const double height_m = std::exp2(step / steps_per_octave);
    found = made_
                .emplace(std::pair{step, lean_step},
                         make_aperture(sonar_, wavelength_m_, sonar_.range_m / height_m,
                                       lean_step * lean_step_rad))
                .first;
  }
  return found->second;
}

}  // namespace ensonify::engine
