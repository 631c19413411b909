#include <ensonify/engine/sonar/vehicle/track.h>

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

}  // namespace ensonify::engine
