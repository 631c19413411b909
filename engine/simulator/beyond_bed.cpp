#include <ensonify/engine/simulator/beyond_bed.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <ensonify/engine/sonar/instrument/mounting.h>

namespace ensonify::engine {
namespace {

constexpr double least_share = 0.01;  // of the bins

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
