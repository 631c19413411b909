#include <ensonify/engine/run/one_part.h>

#include <span>

#include <fmt/format.h>

#include <ensonify/engine/run/whole_run.h>

namespace ensonify::engine {
namespace {

/// Draws the pictures of the pings that are done, if they are due and will not soon be complete.
void grow_pictures(RunState& run, OutputFolder& output, const Simulator& simulator,
                   std::span<const Waterfall> images, double left_s) {
  if (left_s < 1.0 || !run.picture_is_due()) return;
  const Clock::time_point start = Clock::now();
  for (std::size_t i = 0; i < images.size(); ++i)
    output.show(images[i].sonar.name + ".png", encode_picture(run.scene, images[i], simulator, i));
  run.picture.written(start);
}

PartRecord write_run(const RunState& run, OutputFolder& output, const Simulator& simulator,
                     ScenePings& pings, const RunPlan& plan) {
  run.report_stage("files", 0, 1);
  PartRecord record =
      write_files(run, pings, simulator, "", run.threads,
                  [&](const std::string& name, const refine::WriteContent& write_content) {
                    output.write(name, write_content);
                  });
  if (run.control.on_outputs)
    run.control.on_outputs({simulator, pings.images, pings.object_visibility});
  std::vector<std::string> warnings = run.warnings;
  const std::vector<std::string> more = warnings_of(record, run.scene.run.intersector);
  warnings.insert(warnings.end(), more.begin(), more.end());
  record.warnings = run.report.extrapolation.appended_to(warnings);
  record.files = output.records();
  const std::string manifest = manifest_of(record, plan);
  output.write("manifest.json", std::as_bytes(std::span(manifest)));
  record.files = output.records();
  run.report_stage("files", 1, 1);
  return record;
}

}  // namespace

PartRecord make_one_part(RunState& run, OutputFolder& output, Simulator& simulator,
                         const TrackPings& track, const RunPlan& plan) {
  if (run.control.shard.count > 1)
    throw SceneError(
        "the run has one part, so there are no shares of it; set output.pings_per_file");
  output.begin();
  if (is_run_in_parts(run.folder))
    throw SceneError(
        fmt::format("{}: the folder holds a run in several parts; choose another folder with -o",
                    run.folder.string()));
  output.require_own(file_names(run.scene, ""));
  Clock::time_point start = Clock::now();
  ScenePings pings = ping_as_one(
      run.scene, simulator, track, run.threads,
      [&](std::span<const Waterfall> images, std::size_t done, std::size_t of) {
        run.report_stage("pings", done, of);
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
  with_memory_for("the files", [&] { record = write_run(run, output, simulator, pings, plan); });
  output.keep();
  run.report.files_s = seconds_since(start);
  run.report.disk_s = output.disk_s();
  return record;
}

}  // namespace ensonify::engine
