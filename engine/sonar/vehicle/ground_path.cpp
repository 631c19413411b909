#include <ensonify/engine/sonar/vehicle/ground_path.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace ensonify::engine {
namespace {

Eigen::Vector2d forward(double course_rad) { return {std::sin(course_rad), std::cos(course_rad)}; }
Eigen::Vector2d starboard(double course_rad) {
  return {std::cos(course_rad), -std::sin(course_rad)};
}

/// The point at a distance from another one, along a circle or a straight line.
GroundPoint along(const GroundPoint& from, double distance_m) {
  GroundPoint to = from;
  if (from.curvature_1pm == 0.0) {
    to.place += distance_m * forward(from.course_rad);
    return to;
  }
  to.course_rad += from.curvature_1pm * distance_m;
  to.place += (starboard(from.course_rad) - starboard(to.course_rad)) / from.curvature_1pm;
  return to;
}

}  // namespace

GroundPath::GroundPath(const TrackOptions& track) {
  if (track.kind == TrackKind::file)
    throw std::invalid_argument("GroundPath: a recorded track is not generated");
  end_.place = {track.middle_east_m, track.middle_north_m};
  end_.course_rad = track.heading_rad;
  if (track.kind == TrackKind::line) {
    pieces_.push_back({0.0, end_});
    return;
  }
  if (track.legs < 1 || !(track.leg_length_m > 0.0) || !(track.leg_spacing_m > 0.0) ||
      !(track.turn_radius_m >= 0.0))
    throw std::invalid_argument(
        "GroundPath: a lawn-mower needs at least one leg with a positive length and spacing");
  end_.place -= 0.5 * track.leg_length_m * forward(track.heading_rad) +
                0.5 * (track.legs - 1) * track.leg_spacing_m * starboard(track.heading_rad);
  const double radius_m =
      track.turn_radius_m > 0.0 ? track.turn_radius_m : 0.5 * track.leg_spacing_m;
  for (int leg = 0; leg < track.legs; ++leg) {
    end_.leg = std::max(leg - 1, 0);
    if (leg > 0) add_turn(track.leg_spacing_m, radius_m, leg % 2 == 1 ? 1.0 : -1.0);
    end_.leg = leg;
    add(track.leg_length_m, 0.0, false);
  }
}

void GroundPath::add(double length_m, double curvature_1pm, bool turning) {
  end_.curvature_1pm = curvature_1pm;
  end_.turning = turning;
  pieces_.push_back({length_m_, end_});
  end_ = along(end_, length_m);
  length_m_ += length_m;
}

void GroundPath::add_turn(double spacing_m, double radius_m, double side) {
  using std::numbers::pi;
  if (2.0 * radius_m <= spacing_m) {
    add(0.5 * pi * radius_m, side / radius_m, true);
    add(spacing_m - 2.0 * radius_m, 0.0, true);
    add(0.5 * pi * radius_m, side / radius_m, true);
    return;
  }
  const double outwards_rad = std::acos((radius_m + 0.5 * spacing_m) / (2.0 * radius_m));
  add(outwards_rad * radius_m, -side / radius_m, true);
  add((pi + 2.0 * outwards_rad) * radius_m, side / radius_m, true);
  add(outwards_rad * radius_m, -side / radius_m, true);
}

GroundPoint GroundPath::at(double distance_m) const {
  const auto after = std::upper_bound(
      pieces_.begin() + 1, pieces_.end(), distance_m,
      [](double distance, const Piece& piece) { return distance < piece.begin_m; });
  const Piece& piece = *(after - 1);
  return along(piece.start, distance_m - piece.begin_m);
}

double generated_pings(const TrackOptions& track, double ping_interval_s) {
  if (track.kind == TrackKind::line) return track.pings;
  const double step_m = track.speed_mps * ping_interval_s;
  // Rounding may make a whole number of steps slightly too small.
  return std::floor(GroundPath(track).length_m() / step_m * (1.0 + 1e-12)) + 1.0;
}

GeneratedPings generate_pings(const TrackOptions& track, double ping_interval_s,
                              const Oscillator& speed, const std::function<void()>& check) {
  if (track.pings < 1) throw std::invalid_argument("a track needs at least one ping");
  if (!(track.speed_mps >= 0.0) || !(ping_interval_s >= 0.0))
    throw std::invalid_argument("a track's speed and ping interval must not be negative");
  const bool line = track.kind == TrackKind::line;
  if (!line && !(track.speed_mps * ping_interval_s > 0.0))
    throw std::invalid_argument("a lawn-mower needs a speed and a ping interval");
  const GroundPath path(track);
  const auto pings = static_cast<std::int64_t>(generated_pings(track, ping_interval_s));
  const double first =
      line ? -0.5 * static_cast<double>(pings - 1) : 0.0;  // step number of the first ping
  GeneratedPings made;
  int leg = -1;
  for (std::int64_t i = 0; i < pings; ++i) {
    if (check) check();
    const double t_s = static_cast<double>(i) * ping_interval_s;
    const double steps = static_cast<double>(i) + first;
    const GroundPoint point =
        path.at(steps * ping_interval_s * track.speed_mps + speed.integral(t_s));
    if (point.turning && !track.ping_in_turns) continue;
    if (std::exchange(leg, point.leg) != point.leg) made.leg_starts.push_back(made.poses.size());
    const double speed_mps = track.speed_mps + speed.at(t_s);
    Pose& pose = made.poses.emplace_back();
    pose.t_s = t_s;
    pose.position.head<2>() = point.place;
    pose.heading_rad = point.course_rad;
    pose.velocity_mps.head<2>() = speed_mps * forward(point.course_rad);
    pose.heading_rate_radps = point.curvature_1pm * speed_mps;
  }
  return made;
}

}  // namespace ensonify::engine
