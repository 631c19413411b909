#include <ensonify/engine/simulate.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/clock.h>
#include <ensonify/engine/scene/checks/value_check.h>
#include <ensonify/engine/scene/checks/water_check.h>
#include <ensonify/engine/simulator/internals.h>
#include <ensonify/engine/simulator/parts.h>
#include <ensonify/engine/sonar/instrument/mounting.h>

namespace ensonify::engine {

namespace {

/// The range of the bed nearest to a sonar abeam, at most the height over the bed below; no bed is
/// higher than highest_m. Looks at a place in each half octave of distance, at its far end, and
/// takes its bed to begin at the near end: so the range is up to 30 % too short, and hardly ever
/// too long. Relief that is nearer by less than a step of RayLayouts does not count, because the
/// layouts differ as much.
double nearest_bed_m(const Pose& pose, const Sonar& sonar, double height_m, double highest_m,
                     const std::function<double(double x_m, double y_m)>& bed_height_m) {
  constexpr int half_octaves = 10;
  constexpr double step = 0.84;
  if (pose.position.z() - highest_m >= step * height_m) return height_m;
  const Eigen::Vector2d starboard = body_to_world(pose).col(1).head<2>();
  double nearest_m = height_m;
  for (const Side side : sides_of(sonar)) {
    double away_m = std::min(height_m, sonar.range_m);
    for (int i = 0; i < half_octaves; ++i) {
      const Eigen::Vector2d place =
          pose.position.head<2>() + (side == Side::starboard ? away_m : -away_m) * starboard;
      const double below_m = pose.position.z() - bed_height_m(place.x(), place.y());
      away_m /= std::numbers::sqrt2;
      if (!std::isnan(below_m))
        nearest_m = std::min(nearest_m, std::hypot(away_m, std::max(below_m, 0.0)));
    }
  }
  return nearest_m < step * height_m ? nearest_m : height_m;
}

/// How far above the horizontal the bed reaches abeam of a sonar within its range, by side; 0 if
/// not. No bed is higher than highest_m. Looks at a place in each quarter octave of distance.
std::array<double, 2> rise_rad(const Pose& pose, const Sonar& sonar, double highest_m,
                               const std::function<double(double x_m, double y_m)>& bed_height_m) {
  constexpr int quarter_octaves = 24;
  const double per_step = std::exp2(-0.25);
  std::array<double, 2> rise{};
  if (highest_m <= pose.position.z()) return rise;
  const Eigen::Vector2d starboard = body_to_world(pose).col(1).head<2>().normalized();
  for (const Side side : sides_of(sonar)) {
    double away_m = sonar.range_m;
    for (int i = 0; i < quarter_octaves; ++i, away_m *= per_step) {
      const Eigen::Vector2d place =
          pose.position.head<2>() + (side == Side::starboard ? away_m : -away_m) * starboard;
      const double above_m = bed_height_m(place.x(), place.y()) - pose.position.z();
      if (above_m > 0.0)  // never outside the seafloor
        rise[static_cast<std::size_t>(side)] =
            std::max(rise[static_cast<std::size_t>(side)], std::atan2(above_m, away_m));
    }
  }
  return rise;
}

}  // namespace

Simulator::Simulator(const Scene& scene, const Preparation& how)
    : Simulator([&] {
        check_values(scene);
        return std::make_shared<const Ready>(scene, how);
      }()) {}
Simulator::Simulator(std::shared_ptr<const Ready> ready)
    : ready_(std::move(ready)), worker_(std::make_unique<Worker>(*ready_)) {}
Simulator::Simulator(Simulator&&) noexcept = default;
Simulator& Simulator::operator=(Simulator&&) noexcept = default;
Simulator::~Simulator() = default;

Simulator Simulator::clone_for_thread() const {
  Simulator one(ready_);
  if (!worker_->visibility_counters.empty()) one.worker_->count_object_visibility(*ready_);
  return one;
}

std::span<const RayFan> Simulator::aim(const Pose& pose) {
  check_pose(pose);
  worker_->fans.clear();
  for (Worker::BeamTracer& beam : worker_->beams) {
    const Sonar& sonar = worker_->sonars[beam.sonar];
    const Pose sonar_pose = mounted(pose, beam.mounting);
    const double bed_m = bed_height_m(sonar_pose.position.x(), sonar_pose.position.y());
    if (const auto fault = out_of_water(sonar_pose.position, bed_m))
      throw std::invalid_argument(fmt::format(
          "Simulator: the pose puts sonar {} {}; z is up and 0 at the sea surface, so that a depth "
          "is negative{}",
          sonar.name, *fault,
          sonar.mounting == Mounting{} ? "" : "; check the mounting of the sonar"));
    beam.height_m =
        sonar_pose.position.z() - (std::isnan(bed_m) ? ready_->seafloor.mean_bed_m : bed_m);
    const double highest_m = double(ready_->bounds.highest.z());
    const auto bed = [this](double x_m, double y_m) { return bed_height_m(x_m, y_m); };
    const double nearest_m = nearest_bed_m(sonar_pose, sonar, beam.height_m, highest_m, bed);
    for (const RayFan& fan : beam.tracer.aim(sonar_pose, beam.height_m, nearest_m,
                                             rise_rad(sonar_pose, sonar, highest_m, bed)))
      worker_->fans.push_back(fan);
  }
  return worker_->fans;
}

/// A pose in the wrong units or axes gives lines without an echo, which look like a fault.
void Simulator::warn_of_distance(const Pose& pose) {
  const Eigen::Vector2d low = ready_->bounds.lowest.head<2>().cast<double>(),
                        high = ready_->bounds.highest.head<2>().cast<double>(),
                        place = pose.position.head<2>();
  const double outside_m = (place - place.cwiseMax(low).cwiseMin(high)).norm();
  const bool in_reach = std::ranges::any_of(
      worker_->sonars, [&](const Sonar& sonar) { return outside_m <= sonar.range_m; });
  if (in_reach || std::exchange(worker_->warned_of_distance, true)) return;
  worker_->warnings.push_back(fmt::format(
      "the pose at {:.1f} m east, {:.1f} m north is {:.1f} m off the seafloor, out of every sonar's "
      "range: its lines have no bed (the seafloor spans {:.1f} to {:.1f} m east, {:.1f} to {:.1f} "
      "m north)",
      place.x(), place.y(), outside_m, low.x(), high.x(), low.y(), high.y()));
}

std::span<const EchoLine> Simulator::ping_numbered(const Pose& pose, std::uint64_t number) {
  Worker& worker = *worker_;
  if (!(pose.velocity_mps.norm() < sound_speed_mps()))
    throw std::invalid_argument(
        fmt::format("Simulator: the pose's velocity is {:.4g} m/s, expected less than the speed of "
                    "sound, {:.4g} m/s",
                    pose.velocity_mps.norm(), sound_speed_mps()));
  StopWatch watch;
  refine::SpareThreads* spare = std::exchange(worker.spare, nullptr);
  const std::span<const RayFan> fans = aim(pose);
  const Intersector& intersector = worker.needs_hits() ? worker.face_source.prepare(fans)
                                                       : worker.face_source.prepare_runs(fans);
  const refine::Triangles triangles = worker.face_source.triangles();
  if (spare && spare->any()) {
    look_ahead(*spare);
    aim(pose);
  }
  warn_of_distance(pose);
  watch.lap(worker.face_source.found_runs() ? worker.times.trace_s : worker.times.surface_s);
  if (worker.lines.empty()) worker.make_lines();
  std::size_t first_line = 0;
  for (Worker::BeamTracer& beam : worker.beams) {
    const std::size_t i = beam.sonar;
    PingTracer& tracer = beam.tracer;
    const std::size_t sides = sides_of(worker.sonars[i]).size();
    const std::span<EchoLine> lines = std::span(worker.lines).subspan(first_line, sides);
    for (EchoLine& line : lines) {
      const std::uint64_t version = worker.face_source.version();
      tracer.trace(intersector, triangles, version, line.side);
      if (!worker.visibility_counters.empty())
        worker.visibility_counters[i].look(tracer.fan(line.side), triangles,
                                           tracer.runs(triangles, line.side), number);
      watch.lap(worker.times.trace_s);
      tracer.echo(triangles, line.side, line);
      watch.lap(worker.times.echo_s);
    }
    const RayFan& fan = worker.fans[first_line];
    const Eigen::Vector3d down = body_to_world(mounted(pose, beam.mounting)).col(2);
    worker.prepared[i]->chain->receive({.ping = number,
                                        .beam = lines.front().beam,
                                        .t_s = pose.t_s,
                                        .array = {fan.origin, fan.array_axis, down},
                                        .altitude_m = beam.height_m,
                                        .speed_mps = pose.velocity_mps.norm(),
                                        .motion = tracer.receptions()},
                                       lines, worker.memory);
    watch.lap(worker.times.receive_s);
    first_line += sides;
  }
  return worker.lines;
}

/// Makes the faces of the expected pings ready, where the current faces do not cover them.
void Simulator::look_ahead(refine::SpareThreads& spare) {
  try {
    for (const Pose& pose : worker_->expected)
      if (!worker_->face_source.expect(aim(pose), spare)) return;
  } catch (const std::exception&) {
    // That ping may never come; if it does, it throws the same.
  }
}

std::span<const EchoLine> Simulator::ping(const Pose& pose) {
  const std::span<const EchoLine> lines = ping_numbered(pose, worker_->next_ping);
  ++worker_->next_ping;
  return lines;
}

std::vector<EchoLine> Simulator::take_lines() { return std::exchange(worker_->lines, {}); }

void Simulator::set_sonar(std::size_t number, const Sonar& settings) {
  if (number >= worker_->sonars.size())
    throw std::invalid_argument(
        fmt::format("Simulator: there is no sonar {} of {}", number, worker_->sonars.size()));
  Scene changed = ready_->scene;
  changed.sonars = worker_->sonars;
  changed.sonars[number] = settings;
  check_values(changed);
  PreparedSonars sonars = worker_->prepared;
  sonars[number] =
      ready_->prepare(number, settings, worker_->objects.materials(), worker_->warnings);
  worker_->use(std::move(sonars), *ready_);
}

std::uint32_t Simulator::add(MovingObject object, const Pose& pose) {
  Worker& worker = *worker_;
  worker.objects.check(object, pose);
  const std::vector<std::string> materials = worker.objects.materials_with(object.material);
  const bool new_material = materials.size() > worker.objects.materials().size();
  PreparedSonars sonars;
  if (new_material)
    for (std::size_t i = 0; i < worker.sonars.size(); ++i)
      sonars.push_back(ready_->prepare(i, worker.sonars[i], materials, worker.warnings));
  const std::uint32_t instance = worker.objects.add(std::move(object), pose);
  if (new_material) worker.use(std::move(sonars), *ready_);
  return instance;
}

void Simulator::move(std::uint32_t instance, const Pose& pose) {
  worker_->objects.move(instance, pose);
}

void Simulator::remove(std::uint32_t instance) { worker_->objects.remove(instance); }

double Simulator::altitude_m(const Eigen::Vector3d& position) const {
  return position.z() - bed_height_m(position.x(), position.y());
}

double Simulator::bed_height_m(double x_m, double y_m) const {
  return worker_->plumb_line ? worker_->plumb_line->height_m(x_m, y_m)
                             : ready_->bed->height_m(x_m, y_m);
}

std::vector<Pose> Simulator::track() const { return SimulatorInternals::track_poses(*this).poses; }

std::span<const std::string> Simulator::warnings() const { return worker_->warnings; }
std::span<const std::string> Simulator::classes() const { return worker_->objects.classes(); }
std::span<const std::string> Simulator::materials() const { return worker_->objects.materials(); }
const Seafloor& Simulator::seafloor() const { return ready_->seafloor; }
std::span<const Sonar> Simulator::sonars() const { return worker_->sonars; }
double Simulator::sound_speed_mps() const { return ready_->water.sound_speed_mps(); }
const Calibration& Simulator::calibration(std::size_t sonar) const {
  return worker_->prepared.at(sonar)->calibration;
}

}  // namespace ensonify::engine
