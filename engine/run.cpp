#include <ensonify/engine/run.h>

#include <algorithm>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/base/clock.h>
#include <ensonify/engine/output/jsf.h>
#include <ensonify/engine/run/files_read.h>
#include <ensonify/engine/run/joined_files.h>
#include <ensonify/engine/run/run_state.h>
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

std::size_t pings_of_a_part(const Scene& scene, const RunControl& control,
                            std::span<const Sonar> sonars, std::size_t pings) {
  return control.on_outputs ? pings : pings_per_part(scene.output, sonars, pings);
}

RunParts parts_of(const Scene& scene, const RunControl& control,
                  std::span<const std::size_t> leg_starts, std::size_t pings,
                  std::span<const Sonar> sonars) {
  const std::size_t most = pings_of_a_part(scene, control, sonars, pings);
  return scene.output.file_per_leg && !control.on_outputs ? parts_of_legs(leg_starts, pings, most)
                                                          : equal_parts(pings, most);
}

/// The parts of the run, if they can be found before the seafloor is made.
std::optional<RunParts> known_parts(const Scene& scene, const RunControl& control) {
  const TrackOptions& track = scene.track;
  const double interval_s = track.ping_interval_s;
  // In these cases the number of pings depends on the track's file or on the sound speed.
  if (track.kind == TrackKind::file ||
      (track.kind == TrackKind::lawn_mower && !(track.speed_mps * interval_s > 0.0)) ||
      std::ranges::any_of(scene.sonars, [](const Sonar& one) { return one.sample_rate_hz > 0.0; }))
    return std::nullopt;
  check_pings(scene, generated_pings(track, interval_s), "track");
  const GeneratedPings pings =
      generate_pings(track, interval_s, Motion(scene.motion, scene.seed).speed());
  if (pings.poses.empty()) return std::nullopt;
  return parts_of(scene, control, pings.leg_starts, pings.poses.size(), scene.sonars);
}

void append(std::vector<std::string>& warnings, const std::vector<std::string>& more) {
  warnings.insert(warnings.end(), more.begin(), more.end());
}

/// Why this share of the run's parts is empty; an empty text if the share has parts.
std::string no_parts(const Shard& shard, const RunParts& parts) {
  if (shard.begin(parts.count()) < shard.end(parts.count()) || parts.count() == 1) return "";
  return fmt::format(
      "share {} of {} has no parts, because the run has {}; use at most one share per part",
      shard.index, shard.count, parts.count());
}

/// The bytes of the images that are in memory at one time, plus those of the rays. Throws
/// MemoryError if they do not fit.
double require_pings_of(const Scene& scene, const RunControl& control,
                        std::span<const Sonar> sonars, const RunParts& parts) {
  const int threads = refine::thread_count(control.threads);
  return require_pings(control.memory, scene.run, sonars,
                       {.pings = parts.pings(),
                        .images = pings_in_memory(scene, parts, threads),
                        .threads = threads});
}

/// The bytes of the pings, if their number is known before the seafloor is made; otherwise 0.
/// Throws MemoryError if they do not fit.
double expected_ping_bytes(const Scene& scene, const RunControl& control) {
  if (scene.track.kind != TrackKind::line) return 0.0;
  std::vector<Sonar> sonars = scene.sonars;
  for (Sonar& sonar : sonars)
    sonar = sonar.sampled(scene.sea.sound_speed_mps.value_or(scatter::nominal_sound_speed_mps));
  const auto pings = static_cast<std::size_t>(scene.track.pings);
  return require_pings_of(scene, control, sonars,
                          equal_parts(pings, pings_of_a_part(scene, control, sonars, pings)));
}

/// Throws SceneError before the first ping if a recording of the run cannot hold its times.
void require_recordings(const OutputOptions& output, const Simulator& simulator,
                        std::span<const Pose> track) {
  if (!output.jsf || track.empty()) return;
  for (const Sonar& sonar : simulator.sonars())
    for (const Pose& ping : {track.front(), track.back()})
      if (const std::string fault =
              fault_of_jsf(unix_ms_of(output.start_time, track.front().t_s, ping.t_s),
                           2.0 * sonar.bin_m() / simulator.sound_speed_mps());
          !fault.empty())
        throw SceneError(fault);
}

/// The warnings about the scene and its track that the manifest has. The warnings of the scene's
/// text and of the cache, which are the first ones of the simulator, name places. The manifest
/// leaves these out, because the files of a run must not depend on where its scene and cache are.
std::vector<std::string> warnings_of_files(const Scene& scene, const Simulator& simulator,
                                           const TrackPings& track) {
  const std::size_t of_places =
      scene.warnings.size() + SimulatorInternals::prepared(simulator).warnings.size();
  const auto made = simulator.warnings().subspan(of_places);
  std::vector<std::string> warnings(made.begin(), made.end());
  append(warnings, track.warnings());
  return warnings;
}

RunReport make_run(const Scene& scene, const fs::path& folder, const RunControl& control) {
  if (control.shard.count > 1)
    if (const std::optional<RunParts> parts = known_parts(scene, control))
      if (std::string warning = no_parts(control.shard, *parts); !warning.empty())
        return {.counts = {{"pings", 0}},
                .warnings = {std::move(warning)},
                .parts = parts->count(),
                .complete = false};
  require_not_read(scene, folder, files_read(scene));
  OutputFolder output(folder, control.staged);
  RunProgress progress(control);
  const Clock::time_point start = Clock::now();
  Simulator simulator(scene,
                      {.cache = control.cache,
                       .threads = refine::thread_count(control.threads),
                       .progress = [&](std::string_view stage) { progress.report(stage, 0, 1); },
                       .stop_check = [&] { progress.repeat(); },
                       .seafloor = control.seafloor,
                       .memory = control.memory,
                       .more_bytes = expected_ping_bytes(scene, control)});
  const double prepare_s = seconds_since(start);
  const PreparedSeafloor& prepared = SimulatorInternals::prepared(simulator);
  const TrackPings track(scene, simulator);
  require_recordings(scene.output, simulator, track.poses());
  const RunParts parts =
      parts_of(scene, control, track.leg_starts(), track.count(), simulator.sonars());
  require_pings_of(scene, control, simulator.sonars(), parts);
  const std::string reference = world_reference(
      simulator.seafloor().reference, simulator.seafloor().mesh.world_origin, track.middle());
  RunState run{
      .scene = scene,
      .folder = folder,
      .control = control,
      .progress = progress,
      .threads = refine::thread_count(control.threads),
      .plan = make_plan(scene, reference, control.verify_pings, parts),
      .middle = track.middle(),
      .warnings = warnings_of_files(scene, simulator, track),
      .report = {.extrapolation = {simulator.sonars(), simulator.materials(), scene.materials},
                 .origin = prepared.origin,
                 .parts = parts.count(),
                 .prepare_s = prepare_s}};
  if (std::string warning = no_parts(control.shard, parts); !warning.empty())
    run.warnings.push_back(std::move(warning));
  const PartRecord whole = parts.count() > 1 ? make_several_parts(run, output, simulator, track)
                                             : make_one_part(run, output, simulator, track);
  RunReport& report = run.report;
  report.counts = whole.all_counts();
  report.verification = whole.verification;
  for (const FileRecord& file : whole.files) report.files.push_back(folder / file.name);
  report.warnings = scene.warnings;
  append(report.warnings, run.warnings);
  append(report.warnings, warnings_of(whole, scene.run.intersector));
  append(report.warnings, prepared.warnings);
  return std::move(report);
}

}  // namespace

RunReport run(const Scene& scene, const fs::path& folder, const RunControl& control) {
  const refine::StandardFloats floats;
  try {
    return make_run(scene, folder, control);
  } catch (const refine::DamagedFile& damage) {
    // Damage is found when a ping first touches it, in the middle of the run. What was read before
    // was undamaged, but the whole run starts again. A damaged file that the scene names belongs to
    // the user, so it is not removed.
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

bool is_run_in_parts(const fs::path& folder) { return fs::exists(plan_file(folder)); }

RunMergeReport merge_run(const fs::path& folder,
                         const std::function<bool(std::size_t done, std::size_t of)>& progress) {
  const RunPlan plan = read_plan(folder);
  const RunParts& parts = plan.parts;
  RunMergeReport report{.parts = parts.count()};
  for (std::size_t part = 0; part < parts.count(); ++part) {
    if (progress && !progress(part, parts.count())) throw Stopped("stopped on request");
    const fs::path place = folder / parts.folder(part);
    if (!fs::exists(place)) {
      report.missing.push_back(part + 1);
      continue;
    }
    const PartRecord record = read_part_json(place / part_json_name);
    if (record.run_xxh128 != hash_of(plan))
      report.damaged.push_back(fmt::format("{}: it is a part of another run", place.string()));
    for (const FileRecord& file : record.files) {
      const fs::path there = place / file.name;
      if (!fs::exists(there))
        report.damaged.push_back(fmt::format("{}: the file is missing", there.string()));
      else if (xxh128_of_file(there) != file.xxh128)
        report.damaged.push_back(fmt::format("{}: its content has changed", there.string()));
    }
  }
  if (!report.missing.empty() || !report.damaged.empty()) return report;
  report.warnings = finish_run(folder, plan, [&] {
                      if (progress && !progress(parts.count(), parts.count()))
                        throw Stopped("stopped on request");
                    }).warnings;
  return report;
}

}  // namespace ensonify::engine
