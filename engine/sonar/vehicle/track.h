#pragma once

#include <memory>
#include <optional>

#include <Eigen/Core>

#include <ensonify/engine/base/input_file.h>

namespace ensonify::engine {

struct NavigationLog;

/// The position and attitude of a sonar or vehicle at a time.
///
/// The world has x east, y north, z up with the sea surface at z = 0. The body has x forward, y to
/// starboard, z down. Heading turns clockwise from north, then pitch lifts the nose, then roll
/// lowers the starboard side.
struct Pose {
  double t_s = 0.0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< local metres
  double roll_rad = 0.0;
  double pitch_rad = 0.0;
  double heading_rad = 0.0;
  // Rates of change, 0 if unknown: a ping's echoes are received after it was sent.
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
  double roll_rate_radps = 0.0;
  double pitch_rate_radps = 0.0;
  double heading_rate_radps = 0.0;

  /// The pose after `time_s` at constant rates.
  Pose after(double time_s) const;
};

/// Columns are the body's forward, starboard and down directions in the world.
Eigen::Matrix3d body_to_world(const Pose& pose);

enum class TrackKind { line, lawn_mower, file };
/// What the vehicle keeps constant: its depth, or its altitude above the bed.
enum class Vertical { depth, altitude };

/// Where the vehicle goes and when it pings. Its random movements about this track are in motion.h.
struct TrackOptions {
  TrackKind kind = TrackKind::line;
  int pings = 600;  ///< of a line; the length of the other kinds decides how many they have
  double speed_mps = 2.0;
  double heading_rad = 0.0;    ///< of a line, or of a lawn-mower's first leg
  double middle_east_m = 0.0;  ///< local metres; the track of a file is shifted by it
  double middle_north_m = 0.0;
  /// Above the track's mean bed; with Vertical::altitude, above the bed straight below.
  double altitude_m = 10.0;
  /// Time between pings. 0: the two-way time of the longest range; for a file, one ping per row.
  double ping_interval_s = 0.0;
  Vertical vertical = Vertical::depth;
  double follow_s = 5.0;   ///< time constant of the control that keeps the altitude
  double climb_mps = 0.5;  ///< largest vertical speed of that control
  // lawn-mower
  int legs = 4;
  double leg_length_m = 60.0;
  double leg_spacing_m = 20.0;
  double turn_radius_m = 0.0;  ///< 0: half the spacing
  bool ping_in_turns = true;
  // file
  InputFile file;
  std::shared_ptr<const NavigationLog>
      log;                ///< content of the file, in local metres, if the caller has read it
  double smooth_s = 0.0;  ///< time over which a file's places and heights are smoothed
  std::optional<double> origin_latitude_rad, origin_longitude_rad;  ///< the middle of the seabed
};

}  // namespace ensonify::engine
