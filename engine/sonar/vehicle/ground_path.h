#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/sonar/vehicle/motion.h>

namespace ensonify::engine {

struct GroundPoint {
  Eigen::Vector2d place = Eigen::Vector2d::Zero();  ///< east and north, local metres
  double course_rad = 0.0;                          ///< clockwise from north
  double curvature_1pm = 0.0;                       ///< change of the course per metre
  int leg = 0;           ///< number of the leg; a turn has the number of the leg before the turn
  bool turning = false;  ///< whether the point lies in the turn after that leg
};

/// The path of a generated track over ground as a function of the distance along it: an infinite
/// line, with distance 0 at its middle, or a lawn-mower's legs, with distance 0 at the start of the
/// first leg and straight extensions at both ends.
///
/// The legs are parallel, each to starboard of the leg before (seen along the heading of the first
/// leg). Turns of constant radius R join them: for a spacing d of at least 2 R, two quarter circles
/// with a straight part between them; for a smaller spacing a bulb: outwards by the angle a, round
/// by pi + 2 a, and outwards by a again, with cos a = (R + d/2) / 2R (Dubins, Am. J. Math. 79,
/// 1957: the path CCC).
class GroundPath {
 public:
  /// Throws std::invalid_argument for a track from a file, or for legs without a length or spacing.
  explicit GroundPath(const TrackOptions& track);

  /// Sum over a lawn-mower's legs and turns; 0 for a line.
  double length_m() const { return length_m_; }
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

struct GeneratedPings {
  std::vector<Pose> poses;              ///< at height 0
  std::vector<std::size_t> leg_starts;  ///< the first ping of each leg that has pings
};

/// The pings of a generated track. A line has TrackOptions::pings pings, centred on its middle; a
/// lawn-mower has as many as fit on its length, without the pings in turns if ping_in_turns is
/// false. `speed` is the variation of the speed. `check` is called for each ping; what it throws
/// ends the work. Throws std::invalid_argument for a track without pings, a negative speed or
/// interval, or a lawn-mower at zero speed.
GeneratedPings generate_pings(const TrackOptions& track, double ping_interval_s,
                              const Oscillator& speed = {},
                              const std::function<void()>& check = {});

/// The largest number of pings that generate_pings() can return.
double generated_pings(const TrackOptions& track, double ping_interval_s);

}  // namespace ensonify::engine
