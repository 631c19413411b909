#include <ensonify/engine/scene/track_poses.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/base/quantile.h>
#include <ensonify/engine/scene/checks/check.h>
#include <ensonify/engine/scene/checks/water_check.h>
#include <ensonify/engine/scene/world_reference.h>
#include <ensonify/engine/sonar/instrument/mounting.h>
#include <ensonify/engine/sonar/vehicle/ground_path.h>
#include <ensonify/engine/sonar/vehicle/motion.h>
#include <ensonify/engine/sonar/vehicle/recorded_track.h>

namespace ensonify::engine {
namespace {

/// Builds the track of a scene.
class TrackBuilder {
 public:
  TrackBuilder(const Scene& scene, const Ground& ground, double sound_speed_mps)
      : scene_(scene),
        track_(scene.track),
        ground_(ground),
        sound_speed_mps_(sound_speed_mps),
        motion_(scene.motion, scene.seed) {
    interval_s_ = track_.kind == TrackKind::file ? track_.ping_interval_s
                                                 : scene.ping_interval_s(sound_speed_mps);
  }

  TrackPoses build_track() {
    flight_.middle = given_origin(track_);
    if (flight_.middle && ground_.frame.is_on_earth()) {
      flight_.middle.reset();
      flight_.warnings.emplace_back(
          "track.origin_lat_deg and track.origin_lon_deg are not used: the survey has a coordinate "
          "reference system, which places it on Earth");
    }
    if (track_.kind == TrackKind::file)
      read();
    else
      generate();
    find_bed();
    if (track_.vertical == Vertical::altitude || !has_own_height()) set_heights();
    for (Pose& pose : flight_.poses) {
      pose = motion_.applied_to(pose);
      check_stop();
    }
    check();
    return std::move(flight_);
  }

 private:
  bool has_own_height() const { return recorded_ && recorded_->has_height(); }
  std::string what_to_move() const {
    switch (track_.kind) {
      case TrackKind::line:
        return fmt::format(
            "the line is {:.1f} m long: use fewer track.pings, or move track.middle_east_m and "
            "track.middle_north_m",
            (flight_.poses.back().position - flight_.poses.front().position).head<2>().norm());
      case TrackKind::lawn_mower:
        return "use fewer track.legs, or less track.leg_length_m, leg_spacing_m or turn_radius_m, "
               "or move track.middle_east_m and track.middle_north_m";
      case TrackKind::file: break;
    }
    return "move the track with track.middle_east_m and track.middle_north_m, or use another "
           "seafloor";
  }

  void generate() {
    if (track_.kind == TrackKind::lawn_mower && !(track_.speed_mps * interval_s_ > 0.0))
      throw SceneError("track: a lawn-mower needs a track.speed_mps above 0");
    check_pings(scene_, generated_pings(track_, interval_s_), "track");
    GeneratedPings generated =
        generate_pings(track_, interval_s_, motion_.speed(), [this] { check_stop(); });
    flight_.poses = std::move(generated.poses);
    flight_.leg_starts = std::move(generated.leg_starts);
  }

  void read() {
    const NavigationLog log = track_.log ? *track_.log : read_track(track_, ground_.frame);
    const std::string name = track_.file.name;
    flight_.warnings = log.warnings;
    if (const std::size_t repeated = log.repeated_places();
        track_.smooth_s == 0.0 && 5 * repeated > log.t_s.size())
      flight_.warnings.push_back(fmt::format(
          "{}: {} of {} rows repeat the place of the row before, so the track stops and jumps; "
          "if that is slow navigation, smooth it with track.smooth_s",
          name, repeated, log.t_s.size()));
    if (log.origin) flight_.middle = log.origin;
    const RecordedTrack& recorded = recorded_.emplace(log, track_.smooth_s);
    if (interval_s_ == 0.0) {
      check_pings(scene_, static_cast<double>(log.t_s.size()), name);
      for (const double t_s : log.t_s) {
        flight_.poses.push_back(recorded.at(t_s));
        check_stop();
      }
      return;
    }
    const double steps =
        std::floor((recorded.end_s() - recorded.begin_s()) / interval_s_ * (1.0 + 1e-12));
    check_pings(scene_, steps + 1.0, name);
    for (double step = 0.0; step <= steps; ++step) {
      flight_.poses.push_back(recorded.at(recorded.begin_s() + step * interval_s_));
      check_stop();
    }
    warn_of_pauses(log.t_s, name);
  }

  /// Warns if pings lie in pauses of the recorder, as between two lines. If many rows are far
  /// apart, these are not pauses: the rows may be the ends of straight legs.
  void warn_of_pauses(std::span<const double> rows_s, const std::string& name) {
    std::vector<double> steps_s;
    for (std::size_t row = 1; row < rows_s.size(); ++row)
      steps_s.push_back(rows_s[row] - rows_s[row - 1]);
    constexpr double times_longer = 10.0, most_share = 0.1;
    const double least_s = times_longer * median(steps_s);
    std::size_t pauses = 0, pings = 0, longest = 0;
    for (std::size_t step = 0; step < steps_s.size(); ++step) {
      if (!(steps_s[step] > least_s)) continue;
      const auto after = std::ranges::upper_bound(flight_.poses, rows_s[step], {}, &Pose::t_s);
      const auto end = std::ranges::lower_bound(flight_.poses, rows_s[step + 1], {}, &Pose::t_s);
      if (end <= after) continue;
      pings += static_cast<std::size_t>(end - after);
      if (pauses++ == 0 || steps_s[step] > steps_s[longest]) longest = step;
    }
    if (pauses == 0 ||
        static_cast<double>(pauses) > most_share * static_cast<double>(rows_s.size()))
      return;
    flight_.warnings.push_back(fmt::format(
        "{}: {} of {} pings lie in {} of its rows, {} s from t_s {:.10g}; the track is a straight "
        "line there. Split the file there, or leave track.ping_interval_s out for one ping per row",
        name, pings, flight_.poses.size(),
        pauses == 1 ? "a pause" : fmt::format("{} pauses", pauses),
        fmt::format("{}{:.4g}", pauses == 1 ? "" : "the longest ", steps_s[longest]),
        rows_s[longest]));
  }

  void find_bed() {
    bed_m_.clear();
    for (std::size_t i = 0; i < flight_.poses.size(); ++i) {
      const Eigen::Vector3d& p = flight_.poses[i].position;
      check_over_seafloor(p, i);
      bed_m_.push_back(ground_.bed_height_m(p.x(), p.y()));
      check_stop();
    }
    if (std::ranges::all_of(bed_m_, [](double z) { return std::isnan(z); }))
      throw SceneError(
          "track: there is no bed below any of it, only a hole in the seafloor; move "
          "track.middle_east_m and track.middle_north_m");
  }

  void check_over_seafloor(const Eigen::Vector3d& p, std::size_t ping) const {
    const Eigen::Vector2d &low = ground_.lowest, &high = ground_.highest;
    if (p.x() >= low.x() && p.x() <= high.x() && p.y() >= low.y() && p.y() <= high.y()) return;
    throw SceneError(
        fmt::format("track: ping {} lies off the seafloor, at {:.1f} m east, {:.1f} m north (the "
                    "seafloor spans {:.1f} to {:.1f} m east, {:.1f} to {:.1f} m north); {}",
                    ping, p.x(), p.y(), low.x(), high.x(), low.y(), high.y(), what_to_move()));
  }

  void set_heights() {
    if (track_.vertical == Vertical::altitude || recorded_altitude_m(0)) return follow_bed();
    std::vector<double> known_m = bed_m_;
    std::erase_if(known_m, [](double z) { return std::isnan(z); });
    const double mean_bed_m = mean_of(known_m);
    for (Pose& pose : flight_.poses) pose.position.z() = mean_bed_m + track_.altitude_m;
  }

  std::optional<double> recorded_altitude_m(std::size_t ping) const {
    return recorded_ ? recorded_->altitude_m(flight_.poses[ping].t_s) : std::nullopt;
  }

  /// Sets heights by a first-order servo on the altitude with a limited climb; between pings the
  /// vehicle moves straight. Over a hole it follows the last known bed, or the first known bed if
  /// there is none before the hole.
  void follow_bed() {
    std::vector<Pose>& poses = flight_.poses;
    double bed_m = *std::ranges::find_if(bed_m_, [](double z) { return !std::isnan(z); });
    double z_m = 0.0;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if (!std::isnan(bed_m_[i])) bed_m = bed_m_[i];
      const double wanted_m = bed_m + recorded_altitude_m(i).value_or(track_.altitude_m);
      if (i == 0) {
        z_m = wanted_m;
      } else {
        const double step_s = poses[i].t_s - poses[i - 1].t_s;
        const double share = track_.follow_s > 0.0 ? -std::expm1(-step_s / track_.follow_s) : 1.0;
        const double max_m = track_.climb_mps * step_s;
        const double climb_m = std::clamp(share * (wanted_m - z_m), -max_m, max_m);
        poses[i - 1].velocity_mps.z() = step_s > 0.0 ? climb_m / step_s : 0.0;
        z_m += climb_m;
      }
      poses[i].position.z() = z_m;
      poses[i].velocity_mps.z() = 0.0;
    }
  }

  void check() {
    for (std::size_t i = 0; i < flight_.poses.size(); ++i) {
      const Pose& vehicle = flight_.poses[i];
      check_stop();
      check_height(vehicle.position, i, "the vehicle", "");
      check_speed(vehicle, i, "the vehicle");
      for (const Sonar& sonar : scene_.sonars)
        if (sonar.mounting != Mounting{}) {
          const Pose pose = mounted(vehicle, sonar.mounting);
          const std::string what = "sonar " + sonar.name;
          check_height(pose.position, i, what,
                       fmt::format(", or mount the sonar elsewhere (sonar.{}.forward_m, "
                                   "starboard_m, down_m)",
                                   sonar.name));
          check_speed(pose, i, what);
        }
    }
  }

  void check_speed(const Pose& pose, std::size_t ping, std::string_view what) const {
    if (const auto fault = as_fast_as_sound(pose.velocity_mps, sound_speed_mps_))
      throw SceneError(fmt::format(
          "track: at ping {} {} moves at {}; move it more slowly, with less [motion], or mount the "
          "sonar nearer to the vehicle's middle",
          ping, what, *fault));
  }

  void check_height(const Eigen::Vector3d& p, std::size_t ping, std::string_view what,
                    std::string_view or_else) const {
    check_over_seafloor(p, ping);
    const std::string_view remedy = has_own_height() && track_.vertical == Vertical::depth
                                        ? "set track.vertical = \"altitude\""
                                        : "change track.altitude_m";
    const double bed_m = ground_.bed_height_m(p.x(), p.y());
    const auto fault = out_of_water(p, bed_m);
    if (fault && bed_m > 0.0)  // no other altitude helps
      throw SceneError(fmt::format(
          "track: at ping {} {} is {}; the bed there rises {:.1f} m above the sea surface: move the "
          "track to where there is water{}, or check seafloor.water_level_m",
          ping, what, *fault, bed_m,
          scene_.seafloor.kind == SeafloorKind::survey
              ? ", or change the sign of the survey's heights if they are depths, which count "
                "downwards (gdal_calc.py --calc=-A)"
              : ""));
    if (fault)
      throw SceneError(fmt::format(
          "track: at ping {} {} is {}; {}, or move the track{}, or check seafloor.water_level_m",
          ping, what, *fault, remedy, or_else));
  }

  /// Checks rarely, since a pose takes microseconds, and the caller's check may take as long.
  void check_stop() {
    if (++poses_since_check_ < 1024 || !ground_.stop_check) return;
    poses_since_check_ = 0;
    ground_.stop_check();
  }

  const Scene& scene_;
  const TrackOptions& track_;
  const Ground& ground_;
  int poses_since_check_ = 0;
  double sound_speed_mps_;
  Motion motion_;
  double interval_s_ = 0.0;  // 0: one ping per row
  std::optional<RecordedTrack> recorded_;
  std::vector<double> bed_m_;  // heights of the bed below the pings; NaN over a hole
  TrackPoses flight_;
};

}  // namespace

double Scene::ping_interval_s(double sound_speed_mps) const {
  if (track.ping_interval_s > 0.0) return track.ping_interval_s;
  double longest_m = 0.0;
  for (const Sonar& sonar : sonars) longest_m = std::max(longest_m, sonar.range_m);
  return 2.0 * longest_m / sound_speed_mps;
}

TrackPoses build_track(const Scene& scene, const Ground& ground, double sound_speed_mps) {
  return TrackBuilder(scene, ground, sound_speed_mps).build_track();
}

}  // namespace ensonify::engine
