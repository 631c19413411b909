#include <ensonify/engine/sonar/instrument/mounting.h>

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include <ensonify/engine/base/units.h>

namespace ensonify::engine {
namespace {

using Eigen::AngleAxisd, Eigen::Matrix3d, Eigen::Vector3d;

/// The angular velocity about the body's axes, from the heading, pitch and roll rates.
Vector3d angular_velocity_radps(const Pose& pose) {
  const double cr = std::cos(pose.roll_rad), sr = std::sin(pose.roll_rad);
  const double cp = std::cos(pose.pitch_rad), sp = std::sin(pose.pitch_rad);
  return {pose.roll_rate_radps - pose.heading_rate_radps * sp,
          pose.pitch_rate_radps * cr + pose.heading_rate_radps * cp * sr,
          -pose.pitch_rate_radps * sr + pose.heading_rate_radps * cp * cr};
}

/// The inverse of angular_velocity_radps(): sets the rates of a pose. Undefined if the nose points
/// straight up, where there is no heading.
void set_rates(Pose& pose, const Vector3d& angular_velocity) {
  const double cr = std::cos(pose.roll_rad), sr = std::sin(pose.roll_rad);
  const double turning = angular_velocity.y() * sr + angular_velocity.z() * cr;
  pose.pitch_rate_radps = angular_velocity.y() * cr - angular_velocity.z() * sr;
  pose.heading_rate_radps = turning / std::cos(pose.pitch_rad);
  pose.roll_rate_radps = angular_velocity.x() + turning * std::tan(pose.pitch_rad);
}

/// The rotation from the sonar's axes to the vehicle's axes.
Matrix3d turn_of(const Mounting& mounting) {
  const double across_rad = mounting.across ? -90.0 * degree : 0.0;
  return (AngleAxisd(mounting.azimuth_rad, Vector3d::UnitZ()) *
          AngleAxisd(mounting.pitch_rad, Vector3d::UnitY()) *
          AngleAxisd(across_rad, Vector3d::UnitZ()))
      .toRotationMatrix();
}

}  // namespace

Mounting Mounting::ahead(double along_m) const {
  const Vector3d way_m = along_m * turn_of(*this).col(0);
  Mounting there = *this;
  there.forward_m += way_m.x();
  there.starboard_m += way_m.y();
  there.down_m += way_m.z();
  return there;
}

Pose mounted(const Pose& vehicle, const Mounting& mounting) {
  if (mounting == Mounting{}) return vehicle;
  const Matrix3d body = body_to_world(vehicle);
  const Matrix3d turn = turn_of(mounting);
  const Vector3d arm_m{mounting.forward_m, mounting.starboard_m, mounting.down_m};
  const Vector3d angular_velocity = angular_velocity_radps(vehicle);

  Pose sonar = vehicle;
  sonar.position += body * arm_m;
  sonar.velocity_mps += body * angular_velocity.cross(arm_m);
  const Matrix3d axes = body * turn;
  sonar.heading_rad = std::atan2(axes(0, 0), axes(1, 0));
  sonar.pitch_rad = std::asin(std::clamp(axes(2, 0), -1.0, 1.0));
  sonar.roll_rad = std::atan2(-axes(2, 1), -axes(2, 2));
  set_rates(sonar, turn.transpose() * angular_velocity);
  return sonar;
}

}  // namespace ensonify::engine
