#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace ensonify::engine {

/// Where the middle of a moving object is at a time, and how the object is turned there.
struct ObjectPose {
  double t_s = 0.0;
  Eigen::Vector3d place_m = Eigen::Vector3d::Zero();  ///< local metres
  double heading_rad = 0.0, pitch_rad = 0.0, roll_rad = 0.0;
};

/// The way of a moving object. Between two poses it moves evenly on a straight line and turns the
/// shorter way. Before the first pose and after the last it stays there.
class ObjectWay {
 public:
  ObjectWay() = default;
  /// At least one pose. Times must not fall; between two poses of one time it turns at once.
  explicit ObjectWay(std::vector<ObjectPose> poses) : poses_(std::move(poses)) {}

  ObjectPose at(double t_s) const;

 private:
  std::vector<ObjectPose> poses_;
};

/// From `start_m`, at time 0, through the points at a speed; the object looks where it goes. The
/// points are metres east and north of the start, whose height the object keeps. Throws
/// std::invalid_argument if no point lies elsewhere.
ObjectWay way_along(const Eigen::Vector3d& start_m, std::span<const Eigen::Vector2d> points,
                    double speed_mps);

/// The way from a CSV file with the columns t_s, east_m, north_m and heading_deg, and perhaps z_m
/// (height above the sea surface), pitch_deg and roll_deg. Without z_m the object keeps the height
/// of `start_m`. Throws SceneError for a file that cannot be read, and for times that do not
/// ascend.
ObjectWay read_way(const std::filesystem::path& file, const Eigen::Vector3d& start_m);

}  // namespace ensonify::engine
