#include "pipeline.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/dataset/generate.h>
#include <ensonify/engine/run.h>
#include <ensonify/refine/parallel_for.h>

#include "scenes.h"
#include "temporary_folder.h"

namespace ensonify::bench {
namespace {

namespace fs = std::filesystem;

/// A complete task in an empty folder.
struct Case {
  std::string name;
  std::function<PipelineMeasurement(const fs::path& folder, int threads)> measure;
};

PipelineMeasurement measure_run(engine::Scene scene, bool quick, const fs::path& folder,
                                int threads) {
  scene.track.pings = quick ? 128 : 960;  // as long as the bed
  const engine::RunReport report =
      engine::run(scene, folder, {.threads = threads, .cache = folder / "cache"});
  return {.pings = static_cast<std::size_t>(report.counts.at("pings")),
          .prepare_s = report.prepare_s,
          .pings_s = report.pings_s,
          .files_s = report.files_s,
          .wall_s = report.prepare_s + report.pings_s + report.files_s,
          .pings_per_s = static_cast<double>(scene.track.pings) / report.pings_s};
}

/// Makes the recipe's first samples and their seabeds, as the recipe's first shard.
PipelineMeasurement measure_dataset(const engine::Recipe& recipe, bool quick,
                                    const fs::path& folder, int threads) {
  const engine::GenerateReport report =
      engine::generate(recipe, folder / "dataset",
                       {.threads = threads,
                        .shard = {.index = 0, .count = recipe.samples() / (quick ? 4 : 16)},
                        .cache = folder / "cache"});
  if (!report.failed.empty()) throw std::runtime_error(report.failed.begin()->second);
  PipelineMeasurement one{.samples = report.made, .wall_s = report.wall_s};
  for (std::size_t sample = 0; sample < report.made; ++sample)
    one.pings += static_cast<std::size_t>(recipe.sample(sample).scene.track.pings);
  for (const auto& [stage, seconds] : report.stages_s)
    if (stage != "wait")  // the time in which a thread waits for a seafloor of another thread
      (stage == "ping"                        ? one.pings_s
       : stage == "encode" || stage == "disk" ? one.files_s
                                              : one.prepare_s) += seconds;
  one.pings_per_s = static_cast<double>(one.pings) / one.wall_s;
  one.samples_per_s = static_cast<double>(one.samples) / one.wall_s;
  return one;
}

/// The medians of the turns with one number of threads.
PipelineMeasurement middle_of(const std::vector<PipelineMeasurement>& turns) {
  PipelineMeasurement middle = turns.front();
  for (double PipelineMeasurement::*value :
       {&PipelineMeasurement::prepare_s, &PipelineMeasurement::pings_s,
        &PipelineMeasurement::files_s, &PipelineMeasurement::wall_s,
        &PipelineMeasurement::pings_per_s, &PipelineMeasurement::samples_per_s}) {
    std::vector<double> values;
    for (const PipelineMeasurement& turn : turns) values.push_back(turn.*value);
    middle.*value = spread_of(std::move(values)).median;
  }
  return middle;
}

}  // namespace

std::vector<PipelineMeasurement> measure_pipeline(
    std::string_view pattern, bool quick, const std::function<void(std::string_view)>& progress) {
  const double faces = quick ? 0.5e6 : 2e6;
  const std::string size = quick ? "0.5M" : "2M";
  const int turns = quick ? 2 : 3;
  const engine::Recipe recipe(std::string(target_recipe), "target_recognition.toml", {});
  std::vector<Case> cases;
  for (const auto& [bed, make] : {std::pair{"rippled", &ripples}, std::pair{"smooth", &fractal}})
    cases.push_back({fmt::format("run/{}/{}", bed, size),
                     [=, scene = make(faces)](const fs::path& folder, int threads) {
                       return measure_run(scene, quick, folder, threads);
                     }});
  cases.push_back({"dataset/targets", [&](const fs::path& folder, int threads) {
                     return measure_dataset(recipe, quick, folder, threads);
                   }});

  std::vector<int> thread_counts{1};
  if (const int all = refine::thread_count(0); all > 1) thread_counts.push_back(all);
  std::vector<PipelineMeasurement> all;
  for (const Case& one : cases) {
    const auto name_on = [&](int threads) { return fmt::format("{}/{}", one.name, threads); };
    if (std::ranges::none_of(thread_counts, [&](int threads) {
          return name_on(threads).find(pattern) != std::string::npos;
        }))
      continue;
    if (progress) progress(one.name);
    std::vector<std::vector<PipelineMeasurement>> measured(thread_counts.size());
    for (int turn = 0; turn < turns; ++turn)
      for (std::size_t i = 0; i < thread_counts.size(); ++i) {
        const TemporaryFolder folder;
        measured[i].push_back(one.measure(folder.path(), thread_counts[i]));
      }
    for (std::size_t i = 0; i < thread_counts.size(); ++i) {
      PipelineMeasurement& result = all.emplace_back(middle_of(measured[i]));
      result.name = name_on(thread_counts[i]);
      result.threads = thread_counts[i];
      std::vector<double> speedup;
      for (std::size_t turn = 0; turn < measured[i].size(); ++turn)
        speedup.push_back(measured[i][turn].pings_per_s / measured[0][turn].pings_per_s);
      result.speedup = spread_of(std::move(speedup));
    }
  }
  return all;
}

}  // namespace ensonify::bench
