#include <ensonify/engine/simulator/track_warnings.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <ensonify/engine/sonar/echo/ray_layout.h>
#include <ensonify/engine/sonar/instrument/mounting.h>

namespace ensonify::engine {
namespace {

constexpr double least_share = 0.01;     // of the bins
constexpr std::size_t max_poses = 2000;  // the most that are checked
constexpr double max_planes = 1024;      // the most that a sonar may have

/// The distance from a place within a box to the box's edge in a direction.
double to_edge_m(const Eigen::AlignedBox2d& box, const Eigen::Vector2d& place,
                 const Eigen::Vector2d& direction) {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const int axis : {0, 1})
    if (const double along = direction[axis]; along != 0.0) {
      const double edge = along > 0.0 ? box.max()[axis] : box.min()[axis];
      nearest_m = std::min(nearest_m, std::max((edge - place[axis]) / along, 0.0));
    }
  return nearest_m;
}

/// What a sonar sees beyond the bed.
struct Beyond {
  double share = 0.0;  // of all bins
  std::size_t pings = 0, first = 0, last = 0;
  Eigen::AlignedBox2d swath;  // contains the ends of all lines
};

Beyond beyond_bed(const Sonar& sonar, const Eigen::AlignedBox2d& bed, double bed_m,
                  std::span<const Pose> poses) {
  Beyond beyond;
  const auto sectors = static_cast<double>(sonar.sectors().size());
  for (std::size_t ping = 0; ping < poses.size(); ++ping) {
    const Pose pose = mounted(poses[ping], sonar.mounting);
    const double height_m = std::max(pose.position.z() - bed_m, 0.0);
    if (!(height_m < sonar.range_m)) continue;
    const double reach_m = std::sqrt(sonar.range_m * sonar.range_m - height_m * height_m);
    const Eigen::Vector2d place = pose.position.head<2>();
    const Eigen::Vector2d starboard = body_to_world(pose).col(1).head<2>().normalized();
    double share = 0.0;
    for (const Sector& sector : sonar.sectors()) {
      const Eigen::Vector2d out = sector.out * starboard;
      beyond.swath.extend(place + reach_m * out);
      const double edge_m = to_edge_m(bed, place, out);
      if (edge_m < reach_m) share += 1.0 - std::hypot(edge_m, height_m) / sonar.range_m;
    }
    if (share == 0.0) continue;
    beyond.share += share / (sectors * static_cast<double>(poses.size()));
    if (beyond.pings++ == 0) beyond.first = ping;
    beyond.last = ping;
  }
  return beyond;
}

}  // namespace

std::optional<std::string> coarse_planes_warning(std::span<const Sonar> sonars,
                                                 double sound_speed_mps, const Seafloor& seafloor,
                                                 std::span<const Pose> poses) {
  std::string worst;
  double worst_share = 1.0;
  std::size_t count = 0;
  for (const Sonar& sonar : sonars) {
    if (sonar.steers()) continue;  // the vehicle does not scan the bed with its beams
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

std::optional<std::string> beyond_bed_warning(std::span<const Sonar> sonars,
                                              const SeafloorOptions& options,
                                              const Seafloor& seafloor,
                                              std::span<const Pose> poses) {
  const refine::Bounds bounds = seafloor.bounds();
  const Eigen::AlignedBox2d bed(bounds.lowest.head<2>().cast<double>(),
                                bounds.highest.head<2>().cast<double>());
  const Sonar* worst = nullptr;
  Beyond most{.share = least_share};
  for (const Sonar& sonar : sonars)
    if (const Beyond beyond = beyond_bed(sonar, bed, seafloor.mean_bed_m, poses);
        beyond.share > most.share)
      worst = &sonar, most = beyond;
  if (!worst) return std::nullopt;
  std::string larger;
  if (options.kind == SeafloorKind::fractal) {
    // A generated bed lies about the origin.
    const Eigen::Vector2d half_m =
        most.swath.min().cwiseAbs().cwiseMax(most.swath.max().cwiseAbs());
    larger =
        fmt::format("set seafloor.extent_east_m = {:.0f} and seafloor.extent_north_m = {:.0f}, ",
                    std::ceil(std::max(2.0 * half_m.x(), options.extent_east_m)),
                    std::ceil(std::max(2.0 * half_m.y(), options.extent_north_m)));
  }
  return fmt::format(
      "sonar {}: {:.2g} % of its bins are beyond the edge of the bed and are black, in {} of {} pings "
      "(numbers {} to {}): {}move the track, or shorten sonar.{}.range_m",
      worst->name, 100.0 * most.share, most.pings, poses.size(), most.first, most.last, larger,
      worst->name);
}

std::optional<std::string> short_range_warning(const Simulator& simulator,
                                               std::span<const Pose> poses) {
  constexpr double none_m = std::numeric_limits<double>::infinity();
  for (const Sonar& sonar : simulator.sonars()) {
    double least_m = none_m;
    for (const Pose& pose : poses) {
      const double height_m = simulator.altitude_m(mounted(pose, sonar.mounting).position);
      if (height_m < least_m) least_m = height_m;  // over a hole height_m is not a number
      if (least_m <= sonar.range_m) break;
    }
    if (least_m > sonar.range_m && least_m < none_m)
      return fmt::format(
          "sonar {0}: in all {1} pings the bed is {2:.3g} m or more below it, beyond its range of "
          "{3:g} m: lengthen sonar.{0}.range_m, or bring the track nearer to the bed",
          sonar.name, poses.size(), least_m, sonar.range_m);
  }
  return std::nullopt;
}

}  // namespace ensonify::engine
