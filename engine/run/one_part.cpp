#include <filesystem>
#include <span>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/output/png.h>
#include <ensonify/engine/run/run_files.h>
#include <ensonify/engine/run/run_state.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

/// Writes the pictures of the finished pings if they are due, unless the pings end within 1 s.
void grow_pictures(RunState& run, OutputFolder& output, const Simulator& simulator,
                   std::span<const Waterfall> images, double left_s) {
  if (left_s < 1.0 || !run.pictures_are_due()) return;
  const Clock::time_point start = Clock::now();
  for (std::size_t i = 0; i < images.size(); ++i)
    output.show(images[i].sonar.name + ".png",
                encode_png(picture_of(run.scene, images[i], simulator, i)));
  run.wrote_pictures(start);
}

PartRecord write_run(const RunState& run, OutputFolder& output, const Simulator& simulator,
                     ScenePings& pings) {
  run.progress.report("files", 0, 1);
  WrittenPings written = write_files(run, pings, simulator, "", run.threads, output);
  if (run.control.on_outputs)
    run.control.on_outputs(
        {simulator, pings.images, written.pictures, written.targets, pings.object_visibility});
  PartRecord& record = written.record;
  std::vector<std::string> warnings = run.warnings;
  const std::vector<std::string> more = warnings_of(record, run.scene.run.intersector);
  warnings.insert(warnings.end(), more.begin(), more.end());
  record.warnings = run.report.extrapolation.appended_to(warnings);
  record.files = output.records();
  output.write("manifest.json", manifest_json(run.plan, record));
  record.files = output.records();
  run.progress.report("files", 1, 1);
  return std::move(record);
}

}  // namespace

PartRecord make_one_part(RunState& run, OutputFolder& output, Simulator& simulator,
                         const TrackPings& track) {
  if (run.control.shard.count > 1)
    throw SceneError(
        "the run has one part, so there are no shares of it; set output.pings_per_file");
  output.begin();
  if (fs::exists(plan_file(run.folder)))
    throw SceneError(
        fmt::format("{}: the folder holds a run in several parts; choose another folder with -o",
                    run.folder.string()));
  output.require_own(file_names(run.scene, "", {0, track.count()}));
  Clock::time_point start = Clock::now();
  ScenePings pings = ping_as_one(
      run.scene, simulator, track, run.threads,
      [&](std::span<const Waterfall> images, std::size_t done, std::size_t of) {
        run.progress.report("pings", done, of);
        if (done == 0) return;
        const double left_s =
            seconds_since(start) * static_cast<double>(of - done) / static_cast<double>(done);
        grow_pictures(run, output, simulator, images, left_s);
      },
      run.control.verify_pings);
  run.report.stages = pings.stages;
  run.report.pings_s = seconds_since(start);

  start = Clock::now();
  PartRecord record;
  with_memory_for("the files", [&] { record = write_run(run, output, simulator, pings); });
  output.keep();
  run.report.files_s = seconds_since(start);
  run.report.disk_s = output.disk_s();
  return record;
}

}  // namespace ensonify::engine
