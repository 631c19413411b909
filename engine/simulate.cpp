#include <ensonify/engine/simulate.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/engine/scene/profile_reader.h>
#include <ensonify/engine/seafloor/bed_below.h>
#include <ensonify/engine/seafloor/material.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/sonar/ping.h>
#include <ensonify/engine/trace/exact_surface.h>
#include <ensonify/engine/trace/surface.h>
#include <ensonify/scatter/backscatter.h>

namespace ensonify::engine {
namespace {

using Clock = std::chrono::steady_clock;

/// Adds the time since the last lap to a stage.
class StopWatch {
 public:
  void lap(double& stage_s) {
    const Clock::time_point now = Clock::now();
    stage_s += std::chrono::duration<double>(now - since_).count();
    since_ = now;
  }

 private:
  Clock::time_point since_ = Clock::now();
};

double mean_bed_height_m(const Seafloor& seafloor) {
  double sum = 0.0;
  for (std::size_t face = 0; face < seafloor.bed_faces; ++face)
    for (const std::uint32_t vertex : seafloor.mesh.faces[face])
      sum += seafloor.mesh.positions[vertex].z();
  return sum / (3.0 * static_cast<double>(seafloor.bed_faces));
}

}  // namespace

StageTimes& StageTimes::operator+=(const StageTimes& other) {
  surface_s += other.surface_s;
  trace_s += other.trace_s;
  echo_s += other.echo_s;
  speckle_s += other.speckle_s;
  return *this;
}

/// What all threads share.
struct Simulator::Ready {
  Scene scene;
  Seafloor seafloor;
  refine::Bounds bounds;
  BedBelow bed_below;
  double mean_bed_m;  ///< height, so it is negative
  SurfaceParts parts;
  std::string code_path;
  double sound_speed_mps;
  std::optional<scatter::SoundSpeedProfile> profile;
  std::vector<Medium> media;                                        ///< one a sonar
  std::vector<std::vector<scatter::BackscatterTable>> by_material;  ///< for each sonar
  std::vector<std::string> warnings;

  explicit Ready(const Scene& of)
      : scene(of),
        seafloor(make_seafloor(of.seafloor, of.seed, of.objects)),
        bounds(refine::bounds(seafloor.mesh)),
        bed_below(seafloor),
        mean_bed_m(mean_bed_height_m(seafloor)),
        parts{.intersector = of.run.intersector,
              .options = of.run.intersection,
              .tree_pings = of.run.tree_pings},
        warnings(seafloor.warnings) {
    if (surface_kind(of.run.surface).needs_progressive_mesh)
      parts.progressive = make_progressive_mesh(seafloor.mesh);
    else
      parts.whole = make_intersector(parts.intersector, seafloor.mesh, parts.options);
    parts.all = seafloor.mesh;
    code_path = make_intersector(parts.intersector, {}, parts.options)->code_path();
    const double half_depth_m = std::max(0.0, -0.5 * mean_bed_m);
    const Sea& sea = scene.sea;
    sound_speed_mps =
        sea.sound_speed_mps.value_or(scatter::sound_speed_mps(sea.water, half_depth_m));
    if (!sea.profile.path.empty()) take_profile();
    for (const Sonar& sonar : scene.sonars)
      media.push_back({sound_speed_mps, sea.absorption_db_per_km
                                            ? *sea.absorption_db_per_km / 1000.0
                                            : scatter::absorption_db_per_m(sea.water, half_depth_m,
                                                                           sonar.frequency_hz)});
    for (const Sonar& sonar : scene.sonars) {
      std::vector<scatter::BackscatterTable>& tables = by_material.emplace_back();
      tables.emplace_back(scatter::Lambert());  // of none: no face has it
      for (std::size_t i = 1; i < seafloor.materials.size(); ++i)
        tables.push_back(table_of(seafloor.materials[i], sonar));
    }
  }

  scatter::BackscatterTable table_of(const std::string& name, const Sonar& sonar) {
    const Material material = material_named(name, scene.materials);
    const bool relief = name == scene.seafloor.material &&
                        scene.seafloor.kind == SeafloorKind::fractal &&
                        scene.seafloor.fractal.sediments_own;
    if (const auto warning = validity_warning(material, sonar.frequency_hz)) warn(*warning);
    return scatter::BackscatterTable(*backscatter_of(material, sonar.frequency_hz, sound_speed_mps,
                                                     relief ? scene.seafloor.cell_m : 0.0));
  }

  void take_profile() {
    profile = read_profile(scene.sea.profile.path);
    const double bed_m = std::max(0.0, -mean_bed_m);
    sound_speed_mps = profile->mean_speed_mps(0.0, bed_m);
    for (const std::string& remark : profile->remarks(0.0, -double(bounds.lowest.z())))
      warn(fmt::format("{}: {}", scene.sea.profile.name, remark));
  }

  Refraction refraction() const {
    return {scene.sea.refraction, profile ? &*profile : nullptr, bounds.highest.z(),
            -double(bounds.lowest.z())};
  }

  void warn(const std::string& warning) {
    if (std::ranges::find(warnings, warning) == warnings.end()) warnings.push_back(warning);
  }
};

/// One thread's own.
struct Simulator::Worker {
  std::unique_ptr<Surface> surface;
  std::vector<Pinger> pingers;
  std::vector<RayFan> fans;
  std::vector<EchoLine> lines;
  StageTimes times;

  explicit Worker(const Ready& ready)
      : surface(surface_kind(ready.scene.run.surface).make(ready.parts)) {
    for (std::size_t i = 0; i < ready.scene.sonars.size(); ++i) {
      const Sonar& sonar = ready.scene.sonars[i];
      pingers.emplace_back(sonar, i, ready.media[i], ready.seafloor, ready.by_material[i],
                           ready.refraction());
      for (const Side side : {Side::port, Side::starboard}) {
        EchoLine& line = lines.emplace_back();
        line.side = side;
        line.bins.assign(static_cast<std::size_t>(sonar.bins));
      }
    }
  }
};

Simulator::Simulator(const Scene& scene) : Simulator(std::make_shared<const Ready>(scene)) {}
Simulator::Simulator(std::shared_ptr<const Ready> ready)
    : ready_(std::move(ready)), worker_(std::make_unique<Worker>(*ready_)) {}
Simulator::Simulator(Simulator&&) noexcept = default;
Simulator& Simulator::operator=(Simulator&&) noexcept = default;
Simulator::~Simulator() = default;

Simulator Simulator::another() const { return Simulator(ready_); }

std::span<const RayFan> Simulator::aim(const Pose& pose) {
  if (!pose.position.allFinite() ||
      !std::isfinite(pose.roll_rad + pose.pitch_rad + pose.heading_rad))
    throw std::invalid_argument("Simulator: the pose is not finite");
  double height_m = altitude_m(pose.position);
  if (!(height_m > 0.0)) height_m = pose.position.z() - ready_->mean_bed_m;  // over a hole
  worker_->fans.clear();
  for (Pinger& pinger : worker_->pingers)
    for (const RayFan& fan : pinger.aim(pose, height_m)) worker_->fans.push_back(fan);
  return worker_->fans;
}

std::span<const EchoLine> Simulator::ping(const Pose& pose, std::uint64_t number) {
  Worker& worker = *worker_;
  StopWatch watch;
  const Intersector& surface = worker.surface->prepare(aim(pose));
  watch.lap(worker.times.surface_s);
  for (std::size_t i = 0; i < worker.pingers.size(); ++i) {
    Pinger& pinger = worker.pingers[i];
    for (const Side side : {Side::port, Side::starboard}) {
      EchoLine& line = worker.lines[2 * i + static_cast<std::size_t>(side)];
      pinger.trace(surface, worker.surface->triangles(), side);
      watch.lap(worker.times.trace_s);
      pinger.echo(worker.surface->triangles(), side, line);
      watch.lap(worker.times.echo_s);
      if (ready_->scene.speckle) pinger.speckle(ready_->scene.seed, number, line);
      watch.lap(worker.times.speckle_s);
    }
  }
  return worker.lines;
}

double Simulator::altitude_m(const Eigen::Vector3d& position) const {
  return position.z() - ready_->bed_below.height_m(position.x(), position.y());
}

std::vector<Pose> Simulator::track() const {
  const Scene& scene = ready_->scene;
  double longest_m = 0.0;
  for (const Sonar& sonar : scene.sonars) longest_m = std::max(longest_m, sonar.range_m);
  const double interval_s = scene.track.ping_interval_s > 0.0
                                ? scene.track.ping_interval_s
                                : 2.0 * longest_m / ready_->sound_speed_mps;
  std::vector<Pose> poses = straight_poses(scene.track, interval_s, 0.0);

  const Eigen::Vector3f& low = ready_->bounds.lowest;
  const Eigen::Vector3f& high = ready_->bounds.highest;
  std::vector<double> bed_m(poses.size());  // heights below the track
  double sum_m = 0.0;
  std::size_t found = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Vector3d& p = poses[i].position;
    if (p.x() < low.x() || p.x() > high.x() || p.y() < low.y() || p.y() > high.y())
      throw SceneError(
          fmt::format("track: ping {} lies off the seafloor, at {:.1f} m east, {:.1f} m north (the "
                      "seafloor spans "
                      "{:.1f} to {:.1f} m east, {:.1f} to {:.1f} m north); the line is {:.1f} m "
                      "long: take fewer "
                      "track.pings, or move track.middle_east_m and track.middle_north_m",
                      i, p.x(), p.y(), low.x(), high.x(), low.y(), high.y(),
                      (poses.back().position - poses.front().position).norm()));
    bed_m[i] = -altitude_m(p);
    if (std::isnan(bed_m[i])) continue;
    sum_m += bed_m[i];
    ++found;
  }
  if (found == 0)
    throw SceneError(
        "track: there is no bed below any of it, only a hole in the seafloor; move "
        "track.middle_east_m and track.middle_north_m");

  const double z_m = sum_m / static_cast<double>(found) + scene.track.altitude_m;
  if (z_m >= 0.0)
    throw SceneError(fmt::format(
        "track: at track.altitude_m = {} the sonar would fly {:.1f} m above the sea surface, the "
        "mean "
        "depth along the line being {:.1f} m; lower it, or check seafloor.water_level_m",
        scene.track.altitude_m, z_m, scene.track.altitude_m - z_m));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    poses[i].position.z() = z_m;
    if (bed_m[i] >= z_m)
      throw SceneError(fmt::format(
          "track: ping {} is {:.1f} m below the bed; raise track.altitude_m or move the line", i,
          bed_m[i] - z_m));
  }
  return poses;
}

std::span<const std::string> Simulator::warnings() const { return ready_->warnings; }
const Seafloor& Simulator::seafloor() const { return ready_->seafloor; }
std::string_view Simulator::code_path() const { return ready_->code_path; }
void Simulator::reset() { worker_->surface->reset(); }
double Simulator::absorption_db_per_m(std::size_t sonar) const {
  return ready_->media.at(sonar).absorption_db_per_m;
}
const StageTimes& Simulator::times() const { return worker_->times; }

}  // namespace ensonify::engine
