#include <ensonify/engine/live/live_scene.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>

#include <ensonify/engine/live/frames.h>
#include <ensonify/engine/simulator/internals.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t map_points = 220;     // along the longer side of the map
constexpr std::size_t track_points = 1500;  // on the map, approximately

Bytes from_above(const Simulator& simulator, std::span<const Pose> poses) {
  const refine::Bounds bounds = simulator.seafloor().bounds();
  BedMap map{.lowest = bounds.lowest.head<2>(), .highest = bounds.highest.head<2>()};
  const Eigen::Vector2f size = map.highest - map.lowest;
  const float step = size.maxCoeff() / static_cast<float>(map_points - 1);
  map.columns = static_cast<std::size_t>(std::max(2.0f, std::round(size.x() / step) + 1));
  map.rows = static_cast<std::size_t>(std::max(2.0f, std::round(size.y() / step) + 1));
  for (std::size_t row = 0; row < map.rows; ++row)
    for (std::size_t column = 0; column < map.columns; ++column) {
      // Slightly inwards, so that the outermost points lie on the bed.
      const auto along = [](std::size_t i, std::size_t of) {
        return 0.001 + 0.998 * static_cast<double>(i) / static_cast<double>(of - 1);
      };
      const Eigen::Vector3d place(map.lowest.x() + size.x() * along(column, map.columns),
                                  map.lowest.y() + size.y() * along(row, map.rows), 0.0);
      map.heights_m.push_back(static_cast<float>(-simulator.altitude_m(place)));
    }
  const std::size_t every = 1 + poses.size() / track_points;
  for (std::size_t i = 0; i < poses.size(); i += every)
    map.track.emplace_back(poses[i].position.head<2>().cast<float>());
  map.track.emplace_back(poses.back().position.head<2>().cast<float>());
  return bed_frame(map);
}

}  // namespace

LiveScene::LiveScene(const Scene& of, const Preparation& how)
    : scene(of),
      memory(how.memory),
      simulator(scene, how),
      track(scene, simulator),
      bed(from_above(simulator, track.poses())) {}

Vehicle LiveScene::planned() const {
  const UsualPing& usual = SimulatorInternals::usual_ping(simulator);
  return {usual.altitude_m, usual.speed_mps};
}

std::vector<std::string> LiveScene::warnings() const {
  const std::span<const std::string> of_scene = simulator.warnings();
  std::vector<std::string> all(of_scene.begin(), of_scene.end());
  all.insert(all.end(), track.warnings().begin(), track.warnings().end());
  if (std::string warning = keys_without_effect(scene.display); !warning.empty())
    all.push_back(std::move(warning));
  return all;
}

Extrapolation LiveScene::extrapolation() const {
  return Extrapolation(simulator.sonars(), simulator.materials(), scene.materials);
}

double LiveScene::interval_s() const {
  const std::span<const Pose> poses = track.poses();
  const double between_s = poses.size() > 1 ? poses[1].t_s - poses[0].t_s : 0.0;
  return between_s > 0.0 ? between_s : 0.1;
}

Pose LiveScene::pose_at(double along) const {
  const std::span<const Pose> poses = track.poses();
  const auto i = static_cast<std::size_t>(along);
  const double share = along - static_cast<double>(i);
  Pose pose = poses[i];
  if (share == 0.0 || i + 1 >= poses.size()) return pose;
  const Pose& next = poses[i + 1];
  const auto mix = [&](double a, double b) { return a + share * (b - a); };
  const auto turn = [&](double a, double b) {
    return a + share * std::remainder(b - a, 2.0 * std::numbers::pi);
  };
  pose.position += share * (next.position - pose.position);
  pose.roll_rad = turn(pose.roll_rad, next.roll_rad);
  pose.pitch_rad = turn(pose.pitch_rad, next.pitch_rad);
  pose.heading_rad = turn(pose.heading_rad, next.heading_rad);
  pose.t_s = mix(pose.t_s, next.t_s);
  return pose;
}

}  // namespace ensonify::engine
