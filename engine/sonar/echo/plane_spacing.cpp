#include <ensonify/engine/sonar/echo/plane_spacing.h>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <ensonify/engine/sonar/instrument/mounting.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t max_poses = 2000;  // the most that are checked
constexpr double max_planes = 1024;      // the most that a sonar may have

}  // namespace

double planes_apart_rad(const Sonar& sonar, double wavelength_m) {
  return 2.0 / sonar.planes *
         std::min(sonar.transmit_array(wavelength_m).null_rad(1),
                  sonar.receive_array(wavelength_m).null_rad(1));
}

std::optional<std::string> coarse_planes_warning(std::span<const Sonar> sonars,
                                                 double sound_speed_mps, const Seafloor& seafloor,
                                                 std::span<const Pose> poses) {
  std::string worst;
  double worst_share = 1.0;
  std::size_t count = 0;
  for (const Sonar& sonar : sonars) {
    const double apart_rad = planes_apart_rad(sonar, sound_speed_mps / sonar.frequency_hz);
    std::vector<Pose> own;
    const std::size_t stride = poses.size() / max_poses + 1;
    for (std::size_t i = 0; i < poses.size(); i += stride)
      own.push_back(mounted(poses[i], sonar.mounting));
    for (const FeatureRecord& feature : seafloor.features) {
      // No heading makes it shorter along the track than its shorter side.
      if (feature.size_m.head<2>().minCoeff() > apart_rad * sonar.range_m) continue;
      const Pose* nearest = nullptr;
      double range_m = sonar.range_m;
      for (const Pose& pose : own)
        if (const double m = (pose.position - feature.middle_m).norm(); m < range_m)
          nearest = &pose, range_m = m;
      if (!nearest) continue;
      const double long_m = feature.size_m.x() * std::abs(std::sin(nearest->heading_rad)) +
                            feature.size_m.y() * std::abs(std::cos(nearest->heading_rad));
      const double down = (nearest->position.z() - feature.middle_m.z()) / range_m;
      const double off_rad = std::asin(std::clamp(down, -1.0, 1.0)) -
                             0.5 * (sonar.sector_low_rad + sonar.sector_end_rad());
      const double apart_m = apart_rad * range_m * std::cos(off_rad);
      if (!(long_m < apart_m)) continue;
      ++count;
      if (long_m / apart_m >= worst_share) continue;
      worst_share = long_m / apart_m;
      const double planes = 2.0 * std::ceil(0.5 * sonar.planes / worst_share);
      worst = fmt::format(
          "{} (instance {}, {}) is {:.2g} m long along the track, less than the {:.2g} m between "
          "the "
          "planes of sonar {}'s fan at its range of {:.3g} m: a ping may miss it or show it too "
          "bright; "
          "{}",
          feature.layer, feature.label.instance, seafloor.classes[feature.label.class_id], long_m,
          apart_m, sonar.name, range_m,
          planes <= max_planes ? fmt::format("set sonar.{}.planes = {}", sonar.name, planes)
                               : std::string("bring the track nearer to it"));
    }
  }
  if (count == 0) return std::nullopt;
  if (count > 1) worst += fmt::format(" ({} more are too short as well)", count - 1);
  return worst;
}

}  // namespace ensonify::engine
