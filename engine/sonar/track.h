#pragma once

#include <vector>

#include <Eigen/Core>

namespace ensonify::engine {

/// Where the sonar is and how it is turned, at a time.
///
/// The world has x east, y north, z up with the sea surface at z = 0. The body has x forward, y to
/// starboard, z down. Heading turns clockwise from north, then pitch lifts the nose, then roll lowers
/// the starboard side.
struct Pose {
  double t_s = 0.0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< local metres
  double roll_rad = 0.0;
  double pitch_rad = 0.0;
  double heading_rad = 0.0;
  // How these change, as far as it is known: a ping's echoes are received after it was sent.
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
  double roll_rate_radps = 0.0;
  double pitch_rate_radps = 0.0;
  double heading_rate_radps = 0.0;

  /// The pose some time later, at constant rates.
  Pose after(double time_s) const;
};

/// Columns are the body's forward, starboard and down directions in the world.
Eigen::Matrix3d body_to_world(const Pose& pose);

/// A straight line at constant depth and speed, whose middle is at a place.
struct StraightTrack {
  int pings = 600;
  double speed_mps = 2.0;
  double heading_rad = 0.0;
  double middle_east_m = 0.0;  ///< local metres
  double middle_north_m = 0.0;
  double altitude_m = 10.0;      ///< over the mean seabed along the line
  double ping_interval_s = 0.0;  ///< 0: the longest range's two-way time
};

/// The poses of a line at height z. Throws std::invalid_argument for no pings, or a speed or interval
/// that is negative.
std::vector<Pose> straight_poses(const StraightTrack& track, double ping_interval_s, double z_m);

}  // namespace ensonify::engine
