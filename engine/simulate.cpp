#include <ensonify/engine/simulate.h>

#include <algorithm>
#include <initializer_list>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/base/clock.h>
#include <ensonify/engine/scene/checks/check.h>
#include <ensonify/engine/scene/checks/water_check.h>
#include <ensonify/engine/seafloor/memory_plan.h>
#include <ensonify/engine/simulator/bed_abeam.h>
#include <ensonify/engine/simulator/internals.h>
#include <ensonify/engine/simulator/ping_all.h>
#include <ensonify/engine/simulator/state.h>
#include <ensonify/engine/sonar/instrument/mounting.h>

namespace ensonify::engine {
namespace {

/// The height of z_m above the first of these beds that lies below z_m; farthest_m if none does.
double height_m_over(double z_m, std::initializer_list<double> beds_m, double farthest_m) {
  for (const double bed_m : beds_m)
    if (bed_m < z_m) return z_m - bed_m;  // false if there is no bed (NaN)
  return farthest_m;
}

}  // namespace

Simulator::Simulator(const Scene& scene, const Preparation& how)
    : Simulator([&] {
        const refine::StandardFloats floats;
        check_values(scene);
        return std::make_shared<const SharedState>(scene, how);
      }()) {}
Simulator::Simulator(std::shared_ptr<const SharedState> shared) : shared_(std::move(shared)) {
  const Entry entry(*shared_);
  own_ = std::make_unique<ThreadState>(*shared_);
}
Simulator::Simulator(Simulator&&) noexcept = default;
Simulator& Simulator::operator=(Simulator&&) noexcept = default;
Simulator::~Simulator() = default;

Simulator Simulator::clone_for_thread() const {
  Simulator one(shared_);
  if (!own_->visibility_counters.empty()) one.own_->count_object_visibility(*shared_);
  return one;
}

void Simulator::aim(const Pose& pose, Aim& aim) {
  check_pose(pose);
  own_->follow_objects(*shared_);
  aim.fans.clear();
  for (std::size_t i = 0; i < own_->sonars.size(); ++i)
    for (int beam = 0; beam < own_->sonars[i].parallel_beams(); ++beam) {
      const Sonar& sonar = own_->sonars[i];
      const Pose sonar_pose = mounted(pose, sonar.beam_mounting(beam));
      const double bed_m = own_->bed.height_m(sonar_pose.position.x(), sonar_pose.position.y());
      if (const auto fault = out_of_water(sonar_pose.position, bed_m))
        throw std::invalid_argument(fmt::format(
            "Simulator: the pose puts sonar {} {}; z is up and 0 at the sea surface, so that a "
            "depth is negative{}",
            sonar.name, *fault,
            sonar.mounting == Mounting{} ? "" : "; check the mounting of the sonar"));
      if (const auto fault = as_fast_as_sound(sonar_pose.velocity_mps, sound_speed_mps()))
        throw std::invalid_argument(
            fmt::format("Simulator: the pose's rates move sonar {} at {}; check the rates and the "
                        "mounting of the sonar",
                        sonar.name, *fault));
      const double height_m = height_m_over(
          sonar_pose.position.z(),
          {bed_m, shared_->seafloor.mean_bed_m, double(shared_->bounds.lowest.z())}, sonar.range_m);
      const BedAbeam abeam =
          look_abeam(sonar_pose, sonar, height_m, shared_->seafloor_heights.highest_m, own_->bed);
      own_->tracers[i].aim(sonar_pose, height_m, abeam.nearest_m, abeam.rise_rad, aim.fans);
      shared_->stop_check();
    }
  aim.fans_only.clear();
  for (const FanAim& fan : aim.fans) aim.fans_only.push_back(fan.fan);
}

/// Without this warning, a pose in wrong units or axes would only give lines without an echo.
void Simulator::warn_of_distance(const Pose& pose) {
  const Eigen::Vector3d low = shared_->bounds.lowest.cast<double>(),
                        high = shared_->bounds.highest.cast<double>(), &place = pose.position;
  const auto distance_m = [&](const Eigen::Vector3d& from) {
    return (from - from.cwiseMax(low).cwiseMin(high)).norm();
  };
  const bool in_reach = std::ranges::any_of(own_->sonars, [&](const Sonar& sonar) {
    return distance_m(mounted(pose, sonar.mounting).position) <= sonar.range_m;
  });
  if (in_reach || std::exchange(own_->warned_of_distance, true)) return;
  own_->warnings.push_back(fmt::format(
      "the pose at {:.1f} m east, {:.1f} m north, {:.1f} m up is {:.1f} m from the seafloor, out of "
      "every sonar's range: its lines have no bed (the seafloor spans {:.1f} to {:.1f} m east, "
      "{:.1f} to {:.1f} m north, {:.1f} to {:.1f} m up)",
      place.x(), place.y(), place.z(), distance_m(place), low.x(), high.x(), low.y(), high.y(),
      low.z(), high.z()));
}

std::span<const EchoLine> Simulator::ping_numbered(const Pose& pose, std::uint64_t number) {
  const Entry entry(*shared_);
  ThreadState& own = *own_;
  if (const auto fault = as_fast_as_sound(pose.velocity_mps, sound_speed_mps()))
    throw std::invalid_argument(fmt::format("Simulator: the pose's velocity is {}", *fault));
  StopWatch watch;
  const auto end_stage = [&](double& seconds) {
    watch.lap(seconds);
    shared_->stop_check();
  };
  refine::SpareThreads* spare = std::exchange(own.spare, nullptr);
  own.objects.follow(shared_->seafloor.moving, pose.t_s);
  aim(pose, own.aim);
  TracedFaces faces = own.prepare_faces();
  if (spare && spare->any()) look_ahead(*spare);
  warn_of_distance(pose);
  const bool found = std::holds_alternative<FoundRuns>(faces);
  end_stage(found ? own.times.trace_s : own.times.surface_s);
  if (own.lines.empty()) own.make_lines();
  std::span<EchoLine> lines = own.lines;
  std::size_t first_fan = 0;
  for (std::size_t sonar = 0; sonar < own.tracers.size(); ++sonar) {
    PingTracer& pinger = own.tracers[sonar];
    const std::span<const LinePlan> plans = pinger.lines();
    const std::span<const FanAim> fans = std::span(own.aim.fans).subspan(first_fan, pinger.fans());
    const std::size_t per_fan = plans.size() / fans.size();
    for (std::size_t fan = 0; fan < fans.size(); ++fan) {
      const FanAim& aim = fans[fan];
      const FanHits& hits = pinger.tracer().trace(aim.fan, first_fan + fan, faces);
      if (!own.visibility_counters.empty())
        own.visibility_counters[sonar].look(aim.fan, hits.triangles, pinger.tracer().runs(aim.fan),
                                            number);
      end_stage(own.times.trace_s);
      pinger.echo(plans.subspan(fan * per_fan, per_fan), aim, hits,
                  lines.subspan(fan * per_fan, per_fan));
      end_stage(own.times.echo_s);
    }
    own.receive(sonar, pose, number, fans, lines.first(plans.size()));
    end_stage(own.times.receive_s);
    first_fan += fans.size();
    lines = lines.subspan(plans.size());
  }
  return own.lines;
}

/// Prepares the faces of the announced pings, if the current faces do not contain them.
void Simulator::look_ahead(refine::SpareThreads& spare) {
  try {
    const auto& [poses, pings] = own_->announced;
    for (const std::size_t ping : pings) {
      if (ping >= poses.size()) continue;
      aim(poses[ping], own_->aim_ahead);
      if (!own_->face_source.announce(own_->aim_ahead.fans_only, spare)) return;
    }
  } catch (const std::exception&) {
    // Ignore the error: the ping may never be requested, and if it is, it throws the same error.
  }
}

std::span<const EchoLine> Simulator::ping(const Pose& pose) {
  const std::span<const EchoLine> lines = ping_numbered(pose, own_->next_ping);
  ++own_->next_ping;
  return lines;
}

std::vector<EchoLine> Simulator::take_lines() { return std::exchange(own_->lines, {}); }

void Simulator::set_sonar(std::size_t number, const Sonar& settings) {
  const std::pair one{number, settings};
  set_sonars({&one, 1});
}

void Simulator::set_sonars(std::span<const std::pair<std::size_t, Sonar>> settings) {
  const Entry entry(*shared_);
  ThreadState& own = *own_;
  Scene changed = shared_->scene;
  for (std::size_t i = 0; i < own.prepared.size(); ++i)
    changed.sonars[i] = own.prepared[i]->settings;
  std::vector<bool> prepare_again(own.prepared.size(), false);
  std::vector<Sonar> set;
  for (const auto& [number, sonar] : settings) {
    if (number >= changed.sonars.size())
      throw std::invalid_argument(
          fmt::format("Simulator: there is no sonar {} of {}", number, changed.sonars.size()));
    changed.sonars[number] = sonar;
    prepare_again[number] = true;
    set.push_back(sonar);
  }
  check_values(changed);
  require_rays(shared_->memory, set, shared_->parts.intersector);
  UsualPing usual = own.usual_ping;
  if (changed.track.kind != TrackKind::file)
    usual.interval_s = changed.ping_interval_s(sound_speed_mps());
  PreparedSonars sonars = own.prepared;
  std::vector<std::string> warnings = own.warnings;
  for (std::size_t i = 0; i < sonars.size(); ++i)
    if (prepare_again[i] || usual.interval_s != own.usual_ping.interval_s)
      sonars[i] = shared_->prepare(i, changed.sonars[i], usual, own.objects.materials(), warnings);
  own.use(std::move(sonars), *shared_);
  own.usual_ping = usual;
  own.warnings = std::move(warnings);
}

std::uint32_t Simulator::add(MovingObject object, const Pose& pose) {
  const Entry entry(*shared_);
  ThreadState& own = *own_;
  own.objects.check(object, pose);
  require_object_fits(static_cast<double>(object.mesh.faces.size()), 0.0,
                      fmt::format("Simulator: '{}'", object.class_name), {shared_->memory});
  const std::vector<std::string> materials = own.objects.materials_with(object.material);
  if (materials.size() > own.objects.materials().size()) {
    PreparedSonars sonars;
    std::vector<std::string> warnings = own.warnings;
    for (std::size_t i = 0; i < own.sonars.size(); ++i)
      sonars.push_back(
          shared_->prepare(i, own.prepared[i]->settings, own.usual_ping, materials, warnings));
    own.use(std::move(sonars), *shared_);  // no effect if add() throws
    own.warnings = std::move(warnings);
  }
  return own.objects.add(std::move(object), pose, shared_->parts.options.stop_check);
}

std::uint32_t Simulator::next_instance() const { return own_->objects.next_instance(); }

void Simulator::move(std::uint32_t instance, const Pose& pose) {
  const Entry entry(*shared_);
  own_->objects.move(instance, pose);
}

void Simulator::remove(std::uint32_t instance) {
  const Entry entry(*shared_);
  own_->objects.remove(instance);
}

double Simulator::altitude_m(const Eigen::Vector3d& position) const {
  const Entry entry(*shared_);
  return position.z() - own_->bed.height_m(position.x(), position.y());
}

std::vector<Pose> Simulator::track() const {
  const Entry entry(*shared_);
  return SimulatorInternals::track_poses(*this).poses;
}

std::span<const std::string> Simulator::warnings() const { return own_->warnings; }
std::span<const std::string> Simulator::classes() const { return own_->objects.classes(); }
std::span<const std::string> Simulator::materials() const { return own_->objects.materials(); }
const Seafloor& Simulator::seafloor() const { return shared_->seafloor; }
std::span<const Sonar> Simulator::sonars() const { return own_->sonars; }
double Simulator::sound_speed_mps() const { return shared_->water.sound_speed_mps(); }
const Calibration& Simulator::calibration(std::size_t sonar) const {
  return own_->prepared.at(sonar)->calibration;
}

}  // namespace ensonify::engine
