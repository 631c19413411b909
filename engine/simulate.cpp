#include <ensonify/engine/simulate.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/engine/scene/profile_reader.h>
#include <ensonify/engine/scene/vertical_pattern_reader.h>
#include <ensonify/engine/seafloor/bed_below.h>
#include <ensonify/engine/seafloor/material.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/sonar/mounting.h>
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
  PreparedSeafloor prepared;
  const Seafloor& seafloor = prepared.seafloor;
  refine::Bounds bounds;
  std::optional<BedGrid> bed;  ///< where the seafloor has its mesh
  SurfaceParts parts;
  std::string code_path;
  double sound_speed_mps;
  std::optional<scatter::SoundSpeedProfile> profile;
  std::vector<Medium> media;                                        ///< one a sonar
  std::vector<std::vector<scatter::BackscatterTable>> by_material;  ///< for each sonar
  std::vector<std::string> warnings;

  Ready(const Scene& of, const Preparation& how)
      : scene(of),
        prepared(prepare_seafloor(of, how)),
        bounds(seafloor.bounds()),
        parts{.progressive = seafloor.progressive,
              .intersector = of.run.intersector,
              .options = of.run.intersection,
              .tree_pings = of.run.tree_pings},
        warnings(seafloor.warnings) {
    if (!seafloor.progressive) {
      if (how.progress) how.progress("tree");
      parts.all = seafloor.mesh;
      parts.whole = make_intersector(parts.intersector, seafloor.mesh, parts.options);
      bed.emplace(seafloor);
    }
    code_path = make_intersector(parts.intersector, {}, parts.options)->code_path();
    const double half_depth_m = std::max(0.0, -0.5 * seafloor.mean_bed_m);
    const Sea& sea = scene.sea;
    sound_speed_mps =
        sea.sound_speed_mps.value_or(scatter::sound_speed_mps(sea.water, half_depth_m));
    if (!sea.profile.path.empty()) take_profile();
    for (Sonar& sonar : scene.sonars) {
      sonar = sonar.sampled(sound_speed_mps);
      if (!sonar.vertical.file.path.empty())
        sonar.vertical.measured = read_vertical_pattern(sonar.vertical.file.path);
    }
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
    const double bed_m = std::max(0.0, -seafloor.mean_bed_m);
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
  std::optional<PlumbLine> plumb_line;  // where the bed is in a progressive mesh
  std::vector<Pinger> pingers;
  std::vector<RayFan> fans;
  std::vector<EchoLine> lines;
  StageTimes times;

  explicit Worker(const Ready& ready)
      : surface(surface_kind(ready.prepared.surface).make(ready.parts)) {
    if (ready.seafloor.progressive) plumb_line.emplace(ready.seafloor);
    for (std::size_t i = 0; i < ready.scene.sonars.size(); ++i) {
      const Sonar& sonar = ready.scene.sonars[i];
      pingers.emplace_back(sonar, i, ready.media[i], ready.seafloor, ready.by_material[i],
                           ready.refraction());
      for (const Side side : sides_of(sonar)) {
        EchoLine& line = lines.emplace_back();
        line.side = side;
        line.bins.assign(static_cast<std::size_t>(sonar.bins));
      }
    }
  }
};

Simulator::Simulator(const Scene& scene, const Preparation& how)
    : Simulator(std::make_shared<const Ready>(scene, how)) {}
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
  worker_->fans.clear();
  for (std::size_t i = 0; i < worker_->pingers.size(); ++i) {
    const Pose its_own = mounted(pose, ready_->scene.sonars[i].mounting);
    double height_m = altitude_m(its_own.position);
    if (!(height_m > 0.0))
      height_m = its_own.position.z() - ready_->seafloor.mean_bed_m;  // over a hole
    for (const RayFan& fan : worker_->pingers[i].aim(its_own, height_m))
      worker_->fans.push_back(fan);
  }
  return worker_->fans;
}

std::span<const EchoLine> Simulator::ping(const Pose& pose, std::uint64_t number) {
  Worker& worker = *worker_;
  StopWatch watch;
  const Intersector& surface = worker.surface->prepare(aim(pose));
  watch.lap(worker.times.surface_s);
  auto next_line = worker.lines.begin();
  for (std::size_t i = 0; i < worker.pingers.size(); ++i) {
    Pinger& pinger = worker.pingers[i];
    for (const Side side : sides_of(ready_->scene.sonars[i])) {
      EchoLine& line = *next_line++;
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
  return position.z() - bed_height_m(position.x(), position.y());
}

double Simulator::bed_height_m(double x_m, double y_m) const {
  return worker_->plumb_line ? worker_->plumb_line->height_m(x_m, y_m)
                             : ready_->bed->height_m(x_m, y_m);
}

Flight Simulator::flight() const {
  const Ready& ready = *ready_;
  return fly(ready.scene,
             {.bed_height_m = [&](double x_m, double y_m) { return bed_height_m(x_m, y_m); },
              .lowest = ready.bounds.lowest.head<2>().cast<double>(),
              .highest = ready.bounds.highest.head<2>().cast<double>(),
              .frame = {.world_origin = ready.seafloor.mesh.world_origin,
                        .has_world = ready.scene.seafloor.kind != SeafloorKind::fractal &&
                                     !ready.seafloor.mesh.world_origin.isZero(),
                        .utm_zone = ready.seafloor.utm_zone}},
             ready.sound_speed_mps);
}

std::vector<Pose> Simulator::track() const { return flight().poses; }

std::span<const std::string> Simulator::warnings() const { return ready_->warnings; }
const Seafloor& Simulator::seafloor() const { return ready_->seafloor; }
const PreparedSeafloor& Simulator::prepared() const { return ready_->prepared; }
std::span<const Sonar> Simulator::sonars() const { return ready_->scene.sonars; }
std::string_view Simulator::code_path() const { return ready_->code_path; }
void Simulator::reset() { worker_->surface->reset(); }
double Simulator::absorption_db_per_m(std::size_t sonar) const {
  return ready_->media.at(sonar).absorption_db_per_m;
}
double Simulator::sound_speed_mps() const { return ready_->sound_speed_mps; }
const StageTimes& Simulator::times() const { return worker_->times; }

}  // namespace ensonify::engine
