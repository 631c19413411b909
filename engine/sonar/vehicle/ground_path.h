#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/sonar/vehicle/motion.h>
#include <ensonify/engine/sonar/vehicle/track.h>

namespace ensonify::engine {

/// A place on the way over ground.
struct GroundPoint {
  Eigen::Vector2d place = Eigen::Vector2d::Zero();  ///< east and north, local metres
  double course_rad = 0.0;                          ///< clockwise from north
  double curvature_1pm = 0.0;                       ///< the course's change a metre
  bool turning = false;                             ///< between two legs
};

/// The way of a generated track over ground, by the distance along it: a line without ends, counted
/// from its middle, or a lawn-mower's legs, counted from the first one's beginning and prolonged
/// at both ends.
///
/// The legs lie side by side, each to starboard of the one before as the first one heads, joined by
/// turns of constant radius R: where the spacing d is 2 R or more, two quarter circles with a
/// straight part between; where it is less, a bulb: outwards by the angle a, round by pi + 2 a, and
/// outwards by a again, with cos a = (R + d/2) / 2R (Dubins, Am. J. Math. 79, 1957: the path CCC).
class GroundPath {
 public:
  /// Throws std::invalid_argument for a track from a file, or legs that are no legs.
  explicit GroundPath(const TrackOptions& track);

  double length_m() const { return length_m_; }  ///< of a lawn-mower's legs and turns; of a line 0
  GroundPoint at(double distance_m) const;

 private:
  struct Piece {
    double begin_m;
    GroundPoint start;
  };
  void add(double length_m, double curvature_1pm, bool turning);
  void add_turn(double spacing_m, double radius_m, double side);

  std::vector<Piece> pieces_;
  GroundPoint end_;  // where the next piece begins
  double length_m_ = 0.0;
};

/// The poses of a generated track's pings at height 0: a line's as many as it says, middle in the
/// middle; a lawn-mower's as many as its length holds, less those in turns if it does not ping
/// there. `speed` is the speed's own change. Throws std::invalid_argument for no ping, a speed or
/// interval that is negative, or a lawn-mower at no speed.
std::vector<Pose> generated_poses(const TrackOptions& track, double ping_interval_s,
                                  const Oscillator& speed = {});

/// How many pings that will be at most.
double generated_pings(const TrackOptions& track, double ping_interval_s);

}  // namespace ensonify::engine
