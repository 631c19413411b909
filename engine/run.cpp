#include <ensonify/engine/run.h>

#include <algorithm>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/clock.h>
#include <ensonify/engine/output/jsf.h>
#include <ensonify/engine/run/files_read.h>
#include <ensonify/engine/run/one_part.h>
#include <ensonify/engine/run/several_parts.h>
#include <ensonify/engine/run/whole_run.h>
#include <ensonify/engine/scene/checks/check.h>
#include <ensonify/engine/scene/dump.h>
#include <ensonify/engine/scene/world_reference.h>
#include <ensonify/engine/simulator/internals.h>
#include <ensonify/engine/simulator/ping_all.h>
#include <ensonify/engine/simulator/seafloor_cache.h>
#include <ensonify/engine/sonar/vehicle/ground_path.h>
#include <ensonify/engine/sonar/vehicle/motion.h>
#include <ensonify/refine/parallel_for.h>
#include <ensonify/refine/standard_floats.h>
#include <ensonify/scatter/sea_water.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

std::size_t pings_of_a_part(const RunState& run, std::span<const Sonar> sonars, std::size_t pings) {
  return run.control.on_outputs ? pings : pings_per_part(run.scene.output, sonars, pings);
}

RunParts parts_of(const RunState& run, std::span<const std::size_t> leg_starts, std::size_t pings,
                  std::span<const Sonar> sonars) {
  const std::size_t most = pings_of_a_part(run, sonars, pings);
  return run.scene.output.file_per_leg && !run.control.on_outputs
             ? parts_of_legs(leg_starts, pings, most)
             : equal_parts(pings, most);
}

/// The parts, where they are known before there is a seafloor to fly over.
std::optional<RunParts> known_parts(const RunState& run) {
  const Scene& scene = run.scene;
  const TrackOptions& track = scene.track;
  const double interval_s = track.ping_interval_s;
  // Otherwise their number depends on the track's file, or on the sound speed.
  if (track.kind == TrackKind::file ||
      (track.kind == TrackKind::lawn_mower && !(track.speed_mps * interval_s > 0.0)) ||
      std::ranges::any_of(scene.sonars, [](const Sonar& one) { return one.sample_rate_hz > 0.0; }))
    return std::nullopt;
  check_pings(scene, generated_pings(track, interval_s), "track");
  const GeneratedPings pings =
      generate_pings(track, interval_s, Motion(scene.motion, scene.seed).speed());
  if (pings.poses.empty()) return std::nullopt;
  return parts_of(run, pings.leg_starts, pings.poses.size(), scene.sonars);
}

/// Why a share of a run makes nothing; empty if it has parts.
std::string no_parts(const Shard& shard, const RunParts& parts) {
  if (shard.begin(parts.count()) < shard.end(parts.count()) || parts.count() == 1) return "";
  return fmt::format(
      "share {} of {} has no parts, because the run has {}; use at most one share per part",
      shard.index, shard.count, parts.count());
}

/// The bytes of the images that are in memory at one time, and of the rays. Throws MemoryError if
/// they do not fit.
double require_pings_of(const RunState& run, std::span<const Sonar> sonars, const RunParts& parts) {
  return require_pings(
      run.control.memory, run.scene.run, sonars,
      {.pings = parts.pings(), .images = run.pings_in_memory(parts), .threads = run.threads});
}

/// Bytes of the pings, if their number is known before the seafloor is made; otherwise 0. Throws as
/// require_pings_of().
double expected_ping_bytes(const RunState& run) {
  if (run.scene.track.kind != TrackKind::line) return 0.0;
  std::vector<Sonar> sonars = run.scene.sonars;
  for (Sonar& sonar : sonars)
    sonar = sonar.sampled(run.scene.sea.sound_speed_mps.value_or(scatter::nominal_sound_speed_mps));
  const auto pings = static_cast<std::size_t>(run.scene.track.pings);
  return require_pings_of(run, sonars, equal_parts(pings, pings_of_a_part(run, sonars, pings)));
}

/// What a recording of the run cannot hold is refused before the first ping.
void require_recordings(const RunState& run, const Simulator& simulator,
                        std::span<const Pose> track) {
  if (!run.scene.output.jsf || track.empty()) return;
  for (const Sonar& sonar : simulator.sonars())
    for (const Pose& ping : {track.front(), track.back()})
      if (const std::string fault =
              fault_of_jsf(unix_ms_of(run.scene.output.start_time, track.front().t_s, ping.t_s),
                           2.0 * sonar.bin_m() / simulator.sound_speed_mps());
          !fault.empty())
        throw SceneError(fault);
}

RunReport make_run(const Scene& scene, const fs::path& folder, const RunControl& control) {
  RunState run{.scene = scene,
               .folder = folder,
               .control = control,
               .threads = refine::thread_count(control.threads),
               .scene_toml = dump_scene(scene, false)};
  if (control.shard.count > 1)
    if (const std::optional<RunParts> parts = known_parts(run))
      if (std::string warning = no_parts(control.shard, *parts); !warning.empty()) {
        run.report.counts["pings"] = 0;
        run.report.parts = parts->count();
        run.report.complete = false;
        run.report.warnings.push_back(std::move(warning));
        return std::move(run.report);
      }
  require_not_read(scene, folder, files_read(scene));
  OutputFolder output(folder, control.staged);
  const Clock::time_point start = Clock::now();
  Simulator simulator(scene,
                      {.cache = control.cache,
                       .threads = control.threads,
                       .progress = [&](std::string_view stage) { run.report_stage(stage, 0, 1); },
                       .stop_check = [&] { run.stop_check(); },
                       .seafloor = control.seafloor,
                       .memory = control.memory,
                       .more_bytes = expected_ping_bytes(run)});
  RunReport& report = run.report;
  report.prepare_s = seconds_since(start);
  const PreparedSeafloor& prepared = SimulatorInternals::prepared(simulator);
  report.origin = prepared.origin;
  report.extrapolation = {simulator.sonars(), simulator.materials(), scene.materials};

  const TrackPings track(scene, simulator);
  // Those of the scene's text and of the cache come first. They name places, so the manifest does
  // not have them: the files do not depend on where and how their scene was written, nor on the
  // cache.
  const auto made = simulator.warnings().subspan(scene.warnings.size() + prepared.warnings.size());
  run.warnings.assign(made.begin(), made.end());
  run.warnings.insert(run.warnings.end(), track.warnings().begin(), track.warnings().end());
  require_recordings(run, simulator, track.poses());
  const RunParts parts = parts_of(run, track.leg_starts(), track.count(), simulator.sonars());
  if (std::string warning = no_parts(control.shard, parts); !warning.empty())
    run.warnings.push_back(std::move(warning));
  require_pings_of(run, simulator.sonars(), parts);
  run.world = {track.middle(),
               world_reference(simulator.seafloor().reference,
                               simulator.seafloor().mesh.world_origin, track.middle())};
  const RunPlan plan = make_plan(scene, run.world.reference, control.verify_pings, parts);
  PartRecord whole = parts.count() > 1 ? make_several_parts(run, output, simulator, track, plan)
                                       : make_one_part(run, output, simulator, track, plan);
  report.counts = counts_of(whole);
  report.verification = whole.verification;
  report.parts = parts.count();
  for (const FileRecord& file : whole.files) report.files.push_back(folder / file.name);
  report.warnings = scene.warnings;
  report.warnings.insert(report.warnings.end(), run.warnings.begin(), run.warnings.end());
  const std::vector<std::string> more = warnings_of(whole, scene.run.intersector);
  report.warnings.insert(report.warnings.end(), more.begin(), more.end());
  report.warnings.insert(report.warnings.end(), prepared.warnings.begin(), prepared.warnings.end());
  return std::move(run.report);
}

}  // namespace

RunReport run(const Scene& scene, const fs::path& folder, const RunControl& control) {
  const refine::StandardFloats floats;
  try {
    return make_run(scene, folder, control);
  } catch (const refine::DamagedFile& damage) {
    // Damage is found at its first touch, in the middle of the run. What was read before was sound,
    // but the whole run starts again. A file that the scene names belongs to the user: it stays.
    if (scene.seafloor.kind == SeafloorKind::progressive) throw;
    std::error_code ignored;
    fs::remove(cache_file(scene, control.cache), ignored);
    RunControl again = control;
    again.seafloor = nullptr;
    RunReport report = make_run(scene, folder, again);
    report.warnings.push_back(fmt::format("{}; it was made again", damage.what()));
    return report;
  }
}

}  // namespace ensonify::engine
