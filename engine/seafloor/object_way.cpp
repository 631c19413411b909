#include <ensonify/engine/seafloor/object_way.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/engine/base/csv_table.h>
#include <ensonify/engine/base/units.h>

namespace ensonify::engine {

using Eigen::Vector2d, Eigen::Vector3d;

ObjectPose ObjectWay::at(double t_s) const {
  const auto next = std::ranges::upper_bound(poses_, t_s, {}, &ObjectPose::t_s);
  ObjectPose pose = next == poses_.begin() ? poses_.front() : *std::prev(next);
  if (next != poses_.begin() && next != poses_.end()) {
    const double share = (t_s - pose.t_s) / (next->t_s - pose.t_s);
    const auto turned = [&](double from_rad, double to_rad) {
      return from_rad + share * std::remainder(to_rad - from_rad, 2.0 * std::numbers::pi);
    };
    pose.place_m += share * (next->place_m - pose.place_m);
    pose.heading_rad = turned(pose.heading_rad, next->heading_rad);
    pose.pitch_rad = turned(pose.pitch_rad, next->pitch_rad);
    pose.roll_rad = turned(pose.roll_rad, next->roll_rad);
  }
  pose.t_s = t_s;
  return pose;
}

ObjectWay way_along(const Vector3d& start_m, std::span<const Vector2d> points, double speed_mps) {
  std::vector<ObjectPose> poses;
  double t_s = 0.0;
  Vector2d at = Vector2d::Zero();
  for (const Vector2d& point : points) {
    const Vector2d way = point - at;
    const double length_m = way.norm();
    if (length_m == 0.0) continue;
    const double heading_rad = std::atan2(way.x(), way.y());
    const auto add = [&](const Vector2d& place) {
      poses.push_back({.t_s = t_s,
                       .place_m = start_m + Vector3d(place.x(), place.y(), 0.0),
                       .heading_rad = heading_rad});
    };
    add(at);
    t_s += length_m / speed_mps;
    add(point);
    at = point;
  }
  if (poses.empty())
    throw std::invalid_argument("its path has no length, expected a point other than its place");
  return ObjectWay(std::move(poses));
}

ObjectWay read_way(const std::filesystem::path& file, const Vector3d& start_m) {
  static constexpr std::array<CsvColumn, 7> columns{{{"t_s"},
                                                     {"east_m"},
                                                     {"north_m"},
                                                     {"heading_deg"},
                                                     {"z_m", false},
                                                     {"pitch_deg", false},
                                                     {"roll_deg", false}}};
  constexpr CsvFormat format{.row = "pose", .columns = columns};
  constexpr double farthest_m = 1e6;
  const CsvTable table = CsvTable::read(file, format);
  std::vector<ObjectPose> poses;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const Vector3d place_m{table.at(row, 1), table.at(row, 2),
                           table.has(4) ? table.at(row, 4) : start_m.z()};
    if (place_m.cwiseAbs().maxCoeff() > farthest_m)
      throw table.fault(row, fmt::format("a place more than {:g} m from 0, 0, 0", farthest_m));
    if (!poses.empty() && table.at(row, 0) <= poses.back().t_s)
      throw table.fault(row, fmt::format("the time {} after {}, expected times that ascend",
                                         table.at(row, 0), poses.back().t_s));
    poses.push_back({.t_s = table.at(row, 0),
                     .place_m = place_m,
                     .heading_rad = table.at(row, 3) * degree,
                     .pitch_rad = table.at(row, 5) * degree,
                     .roll_rad = table.at(row, 6) * degree});
  }
  return ObjectWay(std::move(poses));
}

}  // namespace ensonify::engine
