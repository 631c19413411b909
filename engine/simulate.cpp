#include <ensonify/engine/simulate.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/clock.h>
#include <ensonify/engine/image/display.h>
#include <ensonify/engine/scene/profile_reader.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/scene/value_check.h>
#include <ensonify/engine/scene/vertical_pattern_reader.h>
#include <ensonify/engine/scene/water_check.h>
#include <ensonify/engine/seafloor/bed_height.h>
#include <ensonify/engine/seafloor/material.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/seafloor/seafloor_options.h>
#include <ensonify/engine/simulator_internals.h>
#include <ensonify/engine/sonar/echo/ping_tracer.h>
#include <ensonify/engine/sonar/instrument/mounting.h>
#include <ensonify/engine/sonar/reception/recorder.h>
#include <ensonify/engine/sonar/reception/signal_chain.h>
#include <ensonify/engine/trace/check/agreement.h>
#include <ensonify/engine/trace/face_source.h>
#include <ensonify/engine/trace/face_sources/exact_faces.h>
#include <ensonify/engine/trace/face_sources/faces_with_bodies.h>
#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/validity.h>

namespace ensonify::engine {
namespace {

void require_finite(const Pose& pose) {
  if (!pose.position.allFinite() ||
      !std::isfinite(pose.t_s + pose.roll_rad + pose.pitch_rad + pose.heading_rad))
    throw std::invalid_argument("Simulator: the pose, or its time, is not finite");
}

/// A mesh's place: z up and y forward, where the body has x forward, y to starboard and z down.
Eigen::Isometry3d place_of(const Pose& pose) {
  require_finite(pose);
  Eigen::Matrix3d mesh_to_body;
  mesh_to_body << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
  place.linear() = body_to_world(pose) * mesh_to_body;
  place.translation() = pose.position;
  return place;
}

/// A name's number in a list, or where it would join it.
std::size_t place_in(const std::vector<std::string>& names, const std::string& name) {
  return static_cast<std::size_t>(std::find(names.begin() + 1, names.end(), name) - names.begin());
}

/// A sonar with all that its pings need.
struct Instrument {
  Sonar sonar;                                        ///< with the bins of its digitiser
  std::optional<scatter::SoundSpeedProfile> profile;  ///< with absorption at its frequency
  Medium medium;
  std::vector<scatter::BackscatterTable> by_material;
  std::unique_ptr<const SignalChain> chain;
  Calibration calibration;
};

Calibration calibration_of(const Instrument& its) {
  Calibration made{.absorption_db_per_m = its.medium.absorption_db_per_m,
                   .recorder = &its.chain->recorder(),
                   .median_share = its.chain->median_share()};
  const auto add = [](Side side, std::vector<double> of_bins, std::vector<double>& columns) {
    if (side == Side::port) std::ranges::reverse(of_bins);
    columns.insert(columns.end(), of_bins.begin(), of_bins.end());
  };
  for (const Side side : sides_of(its.sonar)) {
    add(side, its.chain->level_bed(side), made.level_bed);
    add(side, its.chain->automatic_gain(side), made.automatic_gain);
  }
  return made;
}

void warn(const std::string& warning, std::vector<std::string>& warnings) {
  if (std::ranges::find(warnings, warning) == warnings.end()) warnings.push_back(warning);
}

}  // namespace

/// What all threads share.
struct Simulator::Ready {
  Scene scene;
  std::shared_ptr<const PreparedSeafloor> prepared;
  const Seafloor& seafloor = prepared->seafloor;
  std::size_t instances() const { return seafloor.objects.size() + seafloor.features.size(); }
  refine::Bounds bounds;
  const BedGrid* bed = nullptr;  ///< where the seafloor has its mesh
  FaceSourceParts parts;
  std::string code_path;
  double sound_speed_mps;
  std::optional<scatter::SoundSpeedProfile> profile;
  std::vector<std::string> warnings;
  std::vector<std::shared_ptr<const Instrument>> instruments;  ///< one per sonar

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
      with_memory_for("the tree over the seafloor", [&] {
        parts.whole = make_intersector(parts.intersector, seafloor.mesh, parts.options);
        bed = &prepared->bed();
      });
    }
    code_path = make_intersector(parts.intersector, {}, parts.options)->code_path();
    sound_speed_mps = scene.sea.sound_speed_mps.value_or(
        scatter::sound_speed_mps(scene.sea.water, half_depth_m()));
    if (!scene.sea.profile.path.empty()) take_profile();
    for (const Sonar& sonar : scene.sonars)
      instruments.push_back(instrument(instruments.size(), sonar, seafloor.materials, warnings));
  }

  double half_depth_m() const { return std::max(0.0, -0.5 * seafloor.mean_bed_m); }

  void take_profile() {
    profile = read_profile(scene.sea.profile.path);
    const double bed_m = std::max(0.0, -seafloor.mean_bed_m);
    sound_speed_mps = profile->mean_speed_mps(0.0, bed_m);
    for (const std::string& remark : profile->remarks(0.0, -double(bounds.lowest.z())))
      warn(fmt::format("{}: {}", scene.sea.profile.name, remark), warnings);
    warn_of_odd_speeds();
  }

  Refraction refraction(const Instrument& its) const {
    const auto kind =
        std::ranges::find(intersector_kinds(), parts.intersector, &IntersectorKind::name);
    return {scene.sea.refraction, its.profile ? &*its.profile : nullptr, bounds.highest.z(),
            -double(bounds.lowest.z()), kind->takes_lists};
  }

  double nominal_altitude_m(const Sonar& sonar) const {
    return std::min(scene.track.altitude_m, 0.45 * sonar.range_m);
  }

  /// The cast with absorption. A cast has no temperatures, but they follow from its speeds.
  scatter::SoundSpeedProfile absorbing(double frequency_hz) const {
    return profile->with_absorption([&](double depth_m, double mps) {
      if (scene.sea.absorption_db_per_km) return *scene.sea.absorption_db_per_km / 1000.0;
      scatter::SeaWater water = scene.sea.water;
      water.temperature_c = scatter::temperature_of_sound_speed_c(mps, water.salinity_psu, depth_m);
      return scatter::absorption_db_per_m(water, depth_m, frequency_hz);
    });
  }

  void warn_of_odd_speeds() {
    if (scene.sea.absorption_db_per_km) return;
    for (const scatter::SoundSpeedLayer& layer : profile->layers()) {
      if (!std::isfinite(layer.top_m)) continue;
      scatter::SeaWater water = scene.sea.water;
      const auto speed_at = [&](double temperature_c) {
        water.temperature_c = temperature_c;
        return scatter::sound_speed_mps(water, layer.top_m);
      };
      const auto [coldest_c, warmest_c] = scatter::mackenzie_fit.temperature_c;
      const double slowest_mps = speed_at(coldest_c), fastest_mps = speed_at(warmest_c);
      if (layer.top_mps >= slowest_mps && layer.top_mps <= fastest_mps) continue;
      return warn(
          fmt::format(
              "{}: at {:.1f} m the sound speed is {:.1f} m/s, but water of {} psu and {} to {} "
              "degrees has {:.0f} to {:.0f} m/s; its absorption is that of the nearest: set "
              "sea.salinity_psu, or sea.absorption_db_per_km",
              scene.sea.profile.name, layer.top_m, layer.top_mps, water.salinity_psu, coldest_c,
              warmest_c, slowest_mps, fastest_mps),
          warnings);
    }
  }

  std::shared_ptr<const Instrument> instrument(std::size_t number, const Sonar& settings,
                                               const std::vector<std::string>& materials,
                                               std::vector<std::string>& its_warnings) const {
    Instrument made{.sonar = settings.sampled(sound_speed_mps)};
    Sonar& sonar = made.sonar;
    if (!sonar.vertical.file.path.empty())
      sonar.vertical.measured = read_vertical_pattern(sonar.vertical.file.path);
    const Sea& sea = scene.sea;
    if (profile) made.profile = absorbing(sonar.frequency_hz);
    const double bed_m = std::max(0.0, -seafloor.mean_bed_m);
    made.medium = {sound_speed_mps, made.profile ? made.profile->mean_absorption_db_per_m(
                                                       bed_m - nominal_altitude_m(sonar), bed_m)
                                    : sea.absorption_db_per_km
                                        ? *sea.absorption_db_per_km / 1000.0
                                        : scatter::absorption_db_per_m(sea.water, half_depth_m(),
                                                                       sonar.frequency_hz)};
    made.by_material.emplace_back(scatter::Lambert());  // of none: no face has it
    for (std::size_t i = 1; i < materials.size(); ++i)
      made.by_material.push_back(table_of(materials[i], sonar, its_warnings));
    made.chain = std::make_unique<const SignalChain>(sonar, chain_options(number, made, materials));
    made.calibration = calibration_of(made);
    auto instrument = std::make_shared<Instrument>(std::move(made));
    if (profile && !scene.sea.absorption_db_per_km)
      instrument->medium.profile = &*instrument->profile;
    return instrument;
  }

  ChainOptions chain_options(std::size_t number, const Instrument& its,
                             const std::vector<std::string>& materials) const {
    // For the automatic gain and the level bed: the first material is the bed's own.
    const auto& bed_table = its.by_material[std::min<std::size_t>(1, its.by_material.size() - 1)];
    return {.seed = scene.seed,
            .sonar_number = number,
            .speckle = scene.speckle,
            .sound_speed_mps = sound_speed_mps,
            .absorption_db_per_m = its.medium.absorption_db_per_m,
            .heading_rad = scene.track.kind == TrackKind::file ? 0.0 : scene.track.heading_rad,
            .nominal_altitude_m = nominal_altitude_m(its.sonar),
            .nominal_strength =
                [&bed_table](double sine) { return bed_table.sigma_over_sine(sine) * sine; },
            .bed = materials.size() > 1 ? sediment_of(material_named(materials[1], scene.materials))
                                        : std::nullopt,
            .sea = scene.sea.state,
            .arrivals = scene.arrivals,
            .artefacts = scene.artefacts};
  }

  scatter::BackscatterTable table_of(const std::string& name, const Sonar& sonar,
                                     std::vector<std::string>& its_warnings) const {
    const Material material = material_named(name, scene.materials);
    const bool relief = name == scene.seafloor.material &&
                        scene.seafloor.kind == SeafloorKind::fractal &&
                        scene.seafloor.fractal.sediments_own;
    // Checks the parameters alone; extrapolation.h reports frequencies out of range.
    const double valid_hz =
        std::clamp(sonar.frequency_hz, scatter::lowest_valid_hz, scatter::highest_valid_hz);
    if (const auto warning = validity_warning(material, valid_hz)) warn(*warning, its_warnings);
    return scatter::BackscatterTable(*backscatter_of(material, sonar.frequency_hz, sound_speed_mps,
                                                     relief ? scene.seafloor.cell_m : 0.0));
  }
};

/// What one thread owns.
struct Simulator::Worker {
  FacesWithBodies surface;
  std::optional<PlumbLine> plumb_line;  // where the bed is in a progressive mesh
  std::vector<std::string> classes, materials, warnings;
  std::vector<Label> moving;  // labels of the objects added, by body; class 0 where there is none
  std::vector<std::shared_ptr<const Instrument>> instruments;
  std::vector<Sonar> sonars;  // of the instruments
  std::vector<PingTracer> pingers;
  std::vector<ObjectVisibility> views;  // one per sonar, or none
  std::vector<RayFan> fans;
  std::vector<double> heights_m;  // of each sonar over the bed
  std::vector<EchoLine> lines;
  SignalChain::Memory memory;
  std::uint64_t next_ping = 0;
  std::span<const Pose> expected;  // after the next ping
  refine::SpareThreads* spare = nullptr;
  StageTimes times;

  explicit Worker(const Ready& ready)
      : surface(face_source_kind(ready.prepared->surface).make(ready.parts),
                static_cast<std::uint32_t>(ready.seafloor.faces), ready.parts),
        classes(ready.seafloor.classes),
        materials(ready.seafloor.materials),
        warnings(ready.warnings) {
    if (ready.seafloor.progressive) plumb_line.emplace(ready.seafloor);
    hear_with(ready.instruments, ready);
  }

  void hear_with(std::vector<std::shared_ptr<const Instrument>> other, const Ready& ready) {
    instruments = std::move(other);
    sonars.clear();
    pingers.clear();
    lines.clear();
    if (!views.empty()) count_object_visibility(ready);
    for (std::size_t i = 0; i < instruments.size(); ++i) {
      const Instrument& its = *instruments[i];
      sonars.push_back(its.sonar);
      pingers.emplace_back(its.sonar, its.medium, ready.seafloor, its.by_material,
                           ready.refraction(its), &moving);
    }
  }

  void count_object_visibility(const Ready& ready) {
    const bool can =
        !ready.seafloor.objects.empty() && ready.scene.sea.refraction != RefractionMode::full;
    views.assign(can ? sonars.size() : 0, ObjectVisibility(ready.seafloor));
  }

  void make_lines() {
    for (const Sonar& sonar : sonars)
      for (const Side side : sides_of(sonar)) {
        EchoLine& line = lines.emplace_back();
        line.side = side;
        line.bins.assign(static_cast<std::size_t>(sonar.bins));
      }
  }
};

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
  if (!worker_->views.empty()) one.worker_->count_object_visibility(*ready_);
  return one;
}

std::span<const RayFan> Simulator::aim(const Pose& pose) {
  require_finite(pose);
  worker_->fans.clear();
  worker_->heights_m.clear();
  for (std::size_t i = 0; i < worker_->pingers.size(); ++i) {
    const Sonar& sonar = worker_->sonars[i];
    const Pose its_own = mounted(pose, sonar.mounting);
    const double bed_m = bed_height_m(its_own.position.x(), its_own.position.y());
    if (const auto fault = out_of_water(its_own.position, bed_m))
      throw std::invalid_argument(fmt::format(
          "Simulator: the pose puts sonar {} {}; z is up and 0 at the sea surface, so that a depth "
          "is negative{}",
          sonar.name, *fault,
          sonar.mounting == Mounting{} ? "" : "; mind where the sonar is mounted on the vehicle"));
    const double height_m =
        its_own.position.z() - (std::isnan(bed_m) ? ready_->seafloor.mean_bed_m : bed_m);
    worker_->heights_m.push_back(height_m);
    for (const RayFan& fan : worker_->pingers[i].aim(its_own, height_m))
      worker_->fans.push_back(fan);
  }
  return worker_->fans;
}

std::span<const EchoLine> Simulator::ping_numbered(const Pose& pose, std::uint64_t number) {
  Worker& worker = *worker_;
  StopWatch watch;
  refine::SpareThreads* spare = std::exchange(worker.spare, nullptr);
  const Intersector& surface = worker.surface.prepare(aim(pose));
  const refine::Triangles triangles = worker.surface.triangles();
  if (spare && spare->any()) {
    look_ahead(*spare);
    aim(pose);
  }
  watch.lap(worker.times.surface_s);
  if (worker.lines.empty()) worker.make_lines();
  std::size_t first_line = 0;
  for (std::size_t i = 0; i < worker.pingers.size(); ++i) {
    PingTracer& pinger = worker.pingers[i];
    const std::size_t sides = sides_of(worker.sonars[i]).size();
    const std::span<EchoLine> lines = std::span(worker.lines).subspan(first_line, sides);
    for (EchoLine& line : lines) {
      const std::uint64_t version = worker.surface.version();
      if (worker.views.empty())
        pinger.trace(surface, triangles, version, line.side);
      else
        worker.views[i].look(pinger.fan(line.side), triangles,
                             pinger.trace_hits(surface, triangles, version, line.side), number);
      watch.lap(worker.times.trace_s);
      pinger.echo(triangles, line.side, line);
      watch.lap(worker.times.echo_s);
    }
    const RayFan& fan = worker.fans[first_line];
    const Eigen::Vector3d down = body_to_world(mounted(pose, worker.sonars[i].mounting)).col(2);
    worker.instruments[i]->chain->receive({.ping = number,
                                           .t_s = pose.t_s,
                                           .array = {fan.origin, fan.array_axis, down},
                                           .altitude_m = worker.heights_m[i]},
                                          lines, worker.memory);
    watch.lap(worker.times.receive_s);
    first_line += sides;
  }
  return worker.lines;
}

/// Makes the faces of the expected pings ready, as far as those that are there do not do.
void Simulator::look_ahead(refine::SpareThreads& spare) {
  try {
    for (const Pose& pose : worker_->expected)
      if (!worker_->surface.expect(aim(pose), spare)) return;
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
  auto instruments = worker_->instruments;
  instruments[number] = ready_->instrument(number, settings, worker_->materials, worker_->warnings);
  worker_->hear_with(std::move(instruments), *ready_);
}

std::uint32_t Simulator::add(MovingObject object, const Pose& pose) {
  Worker& worker = *worker_;
  const Eigen::Isometry3d place = place_of(pose);
  if (object.mesh.faces.empty()) throw std::invalid_argument("Simulator: the mesh has no faces");
  const std::size_t still = ready_->seafloor.labels.size();
  if (still + worker.surface.bodies() >= max_labels)
    throw std::invalid_argument(
        fmt::format("Simulator: there are {} objects and other labels, and "
                    "no room for more: remove one",
                    max_labels));
  const std::size_t material = place_in(worker.materials, object.material);
  const std::size_t class_id = place_in(worker.classes, object.class_name);
  std::vector<std::string> materials = worker.materials;
  auto instruments = worker.instruments;
  if (material == materials.size()) {
    materials.push_back(object.material);
    for (std::size_t i = 0; i < instruments.size(); ++i)
      instruments[i] = ready_->instrument(i, instruments[i]->sonar, materials, worker.warnings);
  }
  const std::size_t body = worker.surface.add(std::move(object.mesh), place);
  if (material == worker.materials.size()) {
    worker.materials = std::move(materials);
    worker.hear_with(std::move(instruments), *ready_);
  }
  if (class_id == worker.classes.size()) worker.classes.push_back(std::move(object.class_name));
  if (worker.moving.size() <= body) worker.moving.resize(body + 1);
  const std::size_t instance = ready_->instances() + 1 + body;
  worker.moving[body] = {.sediment = static_cast<std::uint16_t>(material),
                         .class_id = static_cast<std::uint16_t>(class_id),
                         .instance = static_cast<std::uint16_t>(instance),
                         .two_sided = true};
  return static_cast<std::uint32_t>(instance);
}

std::size_t Simulator::mesh_of(std::uint32_t instance) const {
  const std::size_t first = ready_->instances() + 1;
  const std::size_t body = instance - first;
  if (instance < first || !worker_->surface.has(body))
    throw std::invalid_argument(
        fmt::format("Simulator: no object that was added has instance {}", instance));
  return body;
}

void Simulator::move(std::uint32_t instance, const Pose& pose) {
  const std::size_t body = mesh_of(instance);
  worker_->surface.move(body, place_of(pose));
}

void Simulator::remove(std::uint32_t instance) { worker_->surface.remove(mesh_of(instance)); }

double Simulator::altitude_m(const Eigen::Vector3d& position) const {
  return position.z() - bed_height_m(position.x(), position.y());
}

double Simulator::bed_height_m(double x_m, double y_m) const {
  return worker_->plumb_line ? worker_->plumb_line->height_m(x_m, y_m)
                             : ready_->bed->height_m(x_m, y_m);
}

std::vector<Pose> Simulator::track() const { return SimulatorInternals::track_poses(*this).poses; }

std::span<const std::string> Simulator::warnings() const { return worker_->warnings; }
std::span<const std::string> Simulator::classes() const { return worker_->classes; }
std::span<const std::string> Simulator::materials() const { return worker_->materials; }
const Seafloor& Simulator::seafloor() const { return ready_->seafloor; }
std::span<const Sonar> Simulator::sonars() const { return worker_->sonars; }
double Simulator::sound_speed_mps() const { return ready_->sound_speed_mps; }
const Calibration& Simulator::calibration(std::size_t sonar) const {
  return worker_->instruments.at(sonar)->calibration;
}

// What programs do not need.

void SimulatorInternals::expect(Simulator& simulator, std::span<const Pose> poses,
                                refine::SpareThreads& spare) {
  simulator.worker_->expected = poses;
  simulator.worker_->spare = &spare;
}

void SimulatorInternals::reset(Simulator& simulator) { simulator.worker_->surface.reset(); }

std::span<const RayFan> SimulatorInternals::aim(Simulator& simulator, const Pose& pose) {
  return simulator.aim(pose);
}

std::vector<std::vector<Hit>> SimulatorInternals::hits(Simulator& simulator, const Pose& pose) {
  const std::span<const RayFan> fans = simulator.aim(pose);
  const Intersector& surface = simulator.worker_->surface.prepare(fans);
  std::vector<std::vector<Hit>> all;
  for (const RayFan& fan : fans) surface.intersect(fan, all.emplace_back(fan.grid->rays()));
  return all;
}

AgreementCounts SimulatorInternals::verify(Simulator& simulator, const Pose& pose) {
  const Simulator::Ready& ready = *simulator.ready_;
  const Seafloor& seafloor = ready.seafloor;
  CheckedMesh mesh{seafloor.mesh, ready.bounds, seafloor.bed_faces};
  if (const auto& progressive = seafloor.progressive) {
    progressive->verify_all();
    mesh.triangles = {progressive->points, progressive->faces, progressive->source_face};
  }
  AgreementCounts counts = compare_ping(simulator.worker_->surface, mesh, simulator.aim(pose),
                                        intersector_kind(ready.parts.intersector).precision);
  counts += compare_height(mesh, pose.position.x(), pose.position.y(),
                           simulator.bed_height_m(pose.position.x(), pose.position.y()));
  return counts;
}

TrackPoses SimulatorInternals::track_poses(const Simulator& simulator) {
  const Simulator::Ready& ready = *simulator.ready_;
  return build_track(
      ready.scene,
      {.bed_height_m = [&](double x_m, double y_m) { return simulator.bed_height_m(x_m, y_m); },
       .lowest = ready.bounds.lowest.head<2>().cast<double>(),
       .highest = ready.bounds.highest.head<2>().cast<double>(),
       .frame = {.world_origin = ready.seafloor.mesh.world_origin,
                 .has_world = ready.scene.seafloor.kind != SeafloorKind::fractal &&
                              !ready.seafloor.mesh.world_origin.isZero(),
                 .utm_zone = ready.seafloor.utm_zone}},
      ready.sound_speed_mps);
}

const PreparedSeafloor& SimulatorInternals::prepared(const Simulator& simulator) {
  return *simulator.ready_->prepared;
}

std::string_view SimulatorInternals::code_path(const Simulator& simulator) {
  return simulator.ready_->code_path;
}

const Recorder& SimulatorInternals::recorder(const Simulator& simulator, std::size_t sonar) {
  return simulator.worker_->instruments.at(sonar)->chain->recorder();
}

void SimulatorInternals::count_object_visibility(Simulator& simulator) {
  simulator.worker_->count_object_visibility(*simulator.ready_);
}

std::span<const ObjectView> SimulatorInternals::object_visibility(const Simulator& simulator,
                                                                  std::size_t sonar) {
  if (simulator.worker_->views.empty()) return {};
  return simulator.worker_->views.at(sonar).views();
}

RefractionCounts SimulatorInternals::refraction_counts(const Simulator& simulator) {
  RefractionCounts sum;
  for (const PingTracer& pinger : simulator.worker_->pingers) sum += pinger.refraction_counts();
  return sum;
}

const StageTimes& SimulatorInternals::times(const Simulator& simulator) {
  return simulator.worker_->times;
}

}  // namespace ensonify::engine
