#include <ensonify/engine/simulator/state.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <mutex>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/base/quantile.h>
#include <ensonify/engine/simulator/ping_all.h>
#include <ensonify/engine/trace/intersector.h>
#include <ensonify/refine/ball_tree.h>
#include <ensonify/refine/parallel_for.h>

namespace ensonify::engine {
namespace {

constexpr double deepest_sea_m = 12000.0;

/// The range of the seafloor's heights. The heights of a bed in tiles are not known, so it may lie
/// anywhere in the water.
HeightRange heights_between(const Seafloor& seafloor, const refine::Bounds& bounds) {
  HeightRange heights{double(bounds.highest.z()), double(bounds.lowest.z())};
  if (seafloor.in_tiles()) {
    heights.highest_m = std::max(heights.highest_m, 0.0);
    heights.lowest_m = std::min(heights.lowest_m, -deepest_sea_m);
  }
  return heights;
}

/// Throws if all of the bed lies above the sea surface. Grids are checked when they are made, but a
/// mesh may be analysed at any height.
void require_sea_over(const refine::Bounds& bounds, const SeafloorOptions& options) {
  if (options.is_grid() || bounds.lowest.z() < 0.0f) return;
  if (options.kind == SeafloorKind::mesh)
    throw refine::MeshError(fmt::format(
        "{}: the whole mesh lies above the sea surface at the water level of {:.2f} m; set "
        "water_level_m, or change the sign of depths that count downwards",
        options.mesh.path.string(), options.water_level_m));
  throw refine::MeshError(fmt::format(
      "{}: the whole mesh lies above the sea surface; analyse it again, from a scene with its "
      "seafloor.water_level_m, or change the sign of depths that count downwards",
      options.progressive.path.string()));
}

}  // namespace

Simulator::SharedState::SharedState(const Scene& of, const Preparation& how)
    : scene(of),
      memory(how.memory),
      prepared(prepare_seafloor(of, how)),
      seafloor(prepared->seafloor),
      bounds(seafloor.bounds()),
      seafloor_heights(heights_between(seafloor, bounds)),
      parts{.progressive = seafloor.progressive,
            .grid = seafloor.grid,
            .clusters = prepared->clusters,
            .intersector = of.run.intersector,
            .options = of.run.intersection,
            .tree_pings = of.run.tree_pings},
      water(of.sea, seafloor.mean_bed_m, double(bounds.lowest.z())),
      usual_ping{.altitude_m = of.track.altitude_m,
                 .speed_mps = of.track.speed_mps,
                 .interval_s = of.ping_interval_s(water.sound_speed_mps())},
      warnings(of.warnings),
      bed_shares(seafloor.material_shares()) {
  parts.options.stop_check = how.stop_check;
  warnings.insert(warnings.end(), prepared->warnings.begin(), prepared->warnings.end());
  warnings.insert(warnings.end(), seafloor.warnings.begin(), seafloor.warnings.end());
  require_sea_over(bounds, of.seafloor);
  std::mutex reporting;
  const std::function<void()> report_tree = [&] {
    const std::lock_guard one_at_a_time(reporting);
    if (how.progress) how.progress("tree");
  };
  if (!seafloor.objects.empty() || !seafloor.grid) report_tree();
  if (seafloor.grid) {
    parts.objects = std::make_shared<const refine::BallTree>(seafloor.mesh, report_tree);
    prepared->bed(how.stop_check);  // makes its grid
  } else if (!seafloor.progressive) {
    parts.all = seafloor.mesh;
    with_memory_for("the tree over the seafloor", [&] {
      parts.whole = make_intersector(parts.intersector, seafloor.mesh, parts.options);
      prepared->bed(how.stop_check);  // makes its grid
    });
  }
  code_path = make_intersector(parts.intersector, {}, parts.options)->code_path();
  warnings.insert(warnings.end(), water.warnings().begin(), water.warnings().end());
  if (scene.track.kind == TrackKind::file) take_recorded_track();
  require_rays(memory, scene.sonars, parts.intersector);
  for (const Sonar& sonar : scene.sonars)
    sonars.push_back(prepare(sonars.size(), sonar, usual_ping, seafloor.materials, warnings));
  objects = object_surfaces(seafloor, refine::thread_count(how.threads), report_tree);
  if (scene.seafloor.penetration_m > 0.0) find_buried();
}

TrackPoses Simulator::SharedState::track_over(BedHeight& bed) const {
  return build_track(scene,
                     {.bed_height_m = std::bind_front(&BedHeight::height_m, &bed),
                      .lowest = bounds.lowest.head<2>().cast<double>(),
                      .highest = bounds.highest.head<2>().cast<double>(),
                      .frame = {.world_origin = seafloor.mesh.world_origin,
                                .has_world = scene.seafloor.kind != SeafloorKind::fractal &&
                                             !seafloor.mesh.world_origin.isZero(),
                                .utm_zone = seafloor.utm_zone,
                                .reference = seafloor.reference},
                      .stop_check = parts.options.stop_check},
                     water.sound_speed_mps());
}

/// Takes the usual altitude, speed and ping interval from the track file, because the options do
/// not have them.
void Simulator::SharedState::take_recorded_track() {
  BedHeight bed(*prepared);
  recorded_track = track_over(bed);
  std::vector<double> altitudes_m, speeds_mps, intervals_s;
  double before_s = std::numeric_limits<double>::quiet_NaN();
  for (const Pose& pose : recorded_track->poses) {
    const double altitude_m =
        pose.position.z() - bed.height_m(pose.position.x(), pose.position.y());
    if (!std::isnan(altitude_m)) altitudes_m.push_back(altitude_m);
    speeds_mps.push_back(pose.velocity_mps.norm());
    if (!std::isnan(before_s)) intervals_s.push_back(pose.t_s - before_s);
    before_s = pose.t_s;
  }
  usual_ping = {.altitude_m = median(std::move(altitudes_m)),
                .speed_mps = median(std::move(speeds_mps)),
                .interval_s = median(std::move(intervals_s))};
}

void Simulator::SharedState::find_buried() {
  if (std::ranges::none_of(sonars.front()->materials, [](const MaterialInSonar& material) {
        return material.sediment.has_value();
      }))
    warnings.emplace_back(
        "seafloor.penetration_m: no sound enters this bed, because nothing of it is a sediment; "
        "give it a material that `ensonify sediments` lists");
  BedHeight bed(*prepared);
  buried = buried_surfaces(objects, std::bind_front(&BedHeight::top, &bed),
                           scene.seafloor.penetration_m);
}

std::shared_ptr<const PreparedSonar> Simulator::SharedState::prepare(
    std::size_t number, const Sonar& settings, const UsualPing& usual,
    const std::vector<std::string>& materials, std::vector<std::string>& its_warnings) const {
  return prepare_sonar(scene, water, usual, number, settings, materials, bed_shares, its_warnings,
                       parts.options.stop_check);
}

HeightRange Simulator::SharedState::heights(const SessionObjects& added) const {
  HeightRange heights = seafloor_heights;
  if (added.any()) {  // objects may be anywhere in the water
    heights.highest_m = std::max(heights.highest_m, 0.0);
    heights.lowest_m = std::min(heights.lowest_m, std::max(added.lowest_m(), -deepest_sea_m));
  }
  return heights;
}

Refraction Simulator::SharedState::refraction(const PreparedSonar& sonar,
                                              const HeightRange& heights) const {
  return {scene.sea.refraction, sonar.profile ? &*sonar.profile : nullptr, heights.highest_m,
          -heights.lowest_m, intersector_kind(parts.intersector).takes_lists};
}

Simulator::ThreadState::ThreadState(const SharedState& shared)
    : face_source(face_source_kind(shared.prepared->origin.surface).make(shared.parts),
                  static_cast<std::uint32_t>(shared.seafloor.faces), shared.parts),
      bed(*shared.prepared),
      objects(shared.seafloor, face_source),
      warnings(shared.warnings),
      usual_ping(shared.usual_ping) {
  objects.add(shared.seafloor.moving, shared.parts.options.stop_check);
  use(shared.sonars, shared);
}

std::vector<PingTracer> Simulator::ThreadState::tracers_of(const PreparedSonars& of,
                                                           const HeightRange& range,
                                                           const SharedState& shared) {
  std::vector<PingTracer> all;
  for (const auto& its : of)
    all.emplace_back(its->sonar, its->medium, shared.seafloor, its->materials,
                     shared.refraction(*its, range), &objects.labels(),
                     ObjectSurfaces{.fixed = &shared.objects,
                                    .moving = &objects.surfaces(),
                                    .buried = &shared.buried,
                                    .bed_height_m = std::bind_front(&BedHeight::height_m, &bed)},
                     shared.parts.options.stop_check);
  return all;
}

void Simulator::ThreadState::use(PreparedSonars others, const SharedState& shared) {
  const HeightRange range = shared.heights(objects);
  std::vector<PingTracer> its_tracers = tracers_of(others, range, shared);
  std::vector<Sonar> its_sonars;
  for (const auto& its : others) its_sonars.push_back(its->sonar);
  // From here on nothing throws, except that a run's counters, which change no ping, begin again.
  tracers = std::move(its_tracers);
  sonars = std::move(its_sonars);
  prepared = std::move(others);
  heights = range;
  lines.clear();
  if (!visibility_counters.empty()) count_object_visibility(shared);
}

void Simulator::ThreadState::follow_objects(const SharedState& shared) {
  if (shared.scene.sea.refraction != RefractionMode::full) return;
  const HeightRange range = shared.heights(objects);
  if (heights == range) return;
  tracers = tracers_of(prepared, range, shared);
  heights = range;
}

void Simulator::ThreadState::count_object_visibility(const SharedState& shared) {
  const bool can =
      !shared.seafloor.objects.empty() && shared.scene.sea.refraction != RefractionMode::full;
  visibility_counters.assign(can ? sonars.size() : 0, VisibilityCounter(shared.seafloor));
}

TracedFaces Simulator::ThreadState::prepare_faces() {
  const auto any = [&](bool (FanTracer::*what)() const) {
    return std::ranges::any_of(tracers,
                               [&](const PingTracer& its) { return (its.tracer().*what)(); });
  };
  if (any(&FanTracer::bends)) return face_source.prepare_bed(aim.fans_only);
  if (any(&FanTracer::needs_hits)) return face_source.prepare(aim.fans_only);
  return face_source.prepare_runs(aim.fans_only);
}

// The sectors of one beam are received together, because each receives the cross-talk of the other.
void Simulator::ThreadState::receive(std::size_t sonar, const Pose& pose, std::uint64_t ping,
                                     std::span<const FanAim> fans, std::span<EchoLine> of_sonar) {
  const std::span<const LinePlan> plans = tracers[sonar].lines();
  const std::size_t sectors = sonars[sonar].sectors().size();
  if (const FanPlanes* planes = tracers[sonar].planes())
    prepared[sonar]->chain->sum_planes(*planes, chain_scratch);
  for (std::size_t first = 0; first < plans.size(); first += sectors) {
    contexts.clear();
    for (const LinePlan& plan : plans.subspan(first, sectors)) {
      const FanAim& aim = fans[plan.fan];
      // A steered beam is that of an array that is turned to look where the beam looks.
      const double cosine = std::sqrt(1.0 - plan.sine * plan.sine);
      const Eigen::Vector3d axis = plan.sine == 0.0
                                       ? aim.fan.array_axis
                                       : cosine * aim.fan.array_axis - plan.sine * aim.motion.abeam;
      contexts.push_back({.ping = ping,
                          .t_s = pose.t_s,
                          .array = {aim.fan.origin, axis, aim.motion.down},
                          .altitude_m = aim.altitude_m,
                          .speed_mps = pose.velocity_mps.norm(),
                          .motion = aim.motion});
    }
    prepared[sonar]->chain->receive(contexts, of_sonar.subspan(first, sectors), chain_scratch);
  }
}

void Simulator::ThreadState::make_lines() {
  for (std::size_t i = 0; i < sonars.size(); ++i)
    for (const LinePlan& plan : tracers[i].lines()) {
      EchoLine& line = lines.emplace_back();
      line.sector = plan.sector;
      line.bins.assign(static_cast<std::size_t>(sonars[i].bins));
    }
}

}  // namespace ensonify::engine
