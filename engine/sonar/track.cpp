#include <ensonify/engine/sonar/track.h>

#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>

namespace ensonify::engine {

Pose Pose::after(double time_s) const {
  Pose later = *this;
  later.t_s += time_s;
  later.position += time_s * velocity_mps;
  later.roll_rad += time_s * roll_rate_radps;
  later.pitch_rad += time_s * pitch_rate_radps;
  later.heading_rad += time_s * heading_rate_radps;
  return later;
}

Eigen::Matrix3d body_to_world(const Pose& pose) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  const Eigen::Matrix3d body_to_north_east_down =
      (AngleAxisd(pose.heading_rad, Vector3d::UnitZ()) *
       AngleAxisd(pose.pitch_rad, Vector3d::UnitY()) * AngleAxisd(pose.roll_rad, Vector3d::UnitX()))
          .toRotationMatrix();
  Eigen::Matrix3d to_east_north_up;
  to_east_north_up << 0, 1, 0,  //
      1, 0, 0,                  //
      0, 0, -1;
  return to_east_north_up * body_to_north_east_down;
}

std::vector<Pose> straight_poses(const StraightTrack& track, double ping_interval_s, double z_m) {
  if (track.pings < 1) throw std::invalid_argument("a track needs one ping at least");
  if (!(track.speed_mps >= 0.0) || !(ping_interval_s >= 0.0))
    throw std::invalid_argument("a track's speed and ping interval must not be negative");
  const Eigen::Vector3d forward{std::sin(track.heading_rad), std::cos(track.heading_rad), 0.0};
  const Eigen::Vector3d middle{track.middle_east_m, track.middle_north_m, z_m};
  std::vector<Pose> poses(static_cast<std::size_t>(track.pings));
  for (int i = 0; i < track.pings; ++i) {
    const double along_m = (i - 0.5 * (track.pings - 1)) * ping_interval_s * track.speed_mps;
    Pose& pose = poses[static_cast<std::size_t>(i)];
    pose.t_s = i * ping_interval_s;
    pose.position = middle + along_m * forward;
    pose.heading_rad = track.heading_rad;
    pose.velocity_mps = track.speed_mps * forward;
  }
  return poses;
}

}  // namespace ensonify::engine
