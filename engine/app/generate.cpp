#include <ensonify/engine/dataset/dataset_json.h>
#include <ensonify/engine/dataset/generate.h>
#include <ensonify/engine/dataset/piece_sizes.h>
#include <ensonify/engine/simulator/prepare.h>
#include <ensonify/refine/parallel_for.h>

#include <algorithm>
#include <functional>
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app.h"
#include "progress.h"

namespace ensonify::engine::app {
namespace {

namespace fs = std::filesystem;

struct GenerateArguments {
  fs::path recipe, folder, data_folder, cache;
  std::vector<std::string> overrides;
  std::string shard = "0/1";
  int threads = 0;
  MemoryLimit memory;
  bool dry_run = false, json = false, quiet = false;
};

double samples_per_hour(const GenerateReport& report) {
  return report.wall_s > 0.0 ? 3600.0 * static_cast<double>(report.made) / report.wall_s : 0.0;
}

void print_report(const GenerateReport& report, const fs::path& folder, int threads) {
  print_note("{}: {} of {} samples; {} made, {} already there, {} failed\n", folder.string(),
             report.found + report.made, report.samples, report.made, report.found,
             report.failed.size());
  if (report.made == 0) return;
  double sum_s = 0.0;
  for (const auto& [stage, seconds] : report.stages_s) sum_s += seconds;
  print_note("{:.4g} samples/hour on {} thread{}; by stage, summed over threads:",
             samples_per_hour(report), threads, threads == 1 ? "" : "s");
  for (const auto& [stage, seconds] : report.stages_s)
    print_note(" {} {:.2f} s ({:.1f} %)", stage, seconds, 100.0 * seconds / sum_s);
  print_note("\n");
}

/// The warnings of the recipe and of the runs.
std::vector<std::string> all_warnings(const Recipe& recipe, const GenerateReport& report) {
  std::vector<std::string> all = recipe.warnings();
  all.insert(all.end(), report.warnings.begin(), report.warnings.end());
  return report.extrapolation.appended_to(all);
}

void print_json(const Recipe& recipe, const GenerateReport& report, const fs::path& folder,
                int threads) {
  nlohmann::ordered_json failed = nlohmann::ordered_json::array();
  for (const auto& [sample, why] : report.failed)
    failed.push_back({{"sample", sample}, {"why", why}});
  print_object({{"folder", folder.string()},
                {"samples", report.samples},
                {"found", report.found},
                {"made", report.made},
                {"failed", failed},
                {"stopped", report.stopped},
                {"warnings", all_warnings(recipe, report)},
                {"samples_per_hour", samples_per_hour(report)},
                {"stages_s", report.stages_s},
                {"wall_s", report.wall_s},
                {"threads", threads}});
}

/// Whether the vehicle would be above the sea surface if the bed were level, at its mean depth. The
/// real bed is known only when it is made, which takes as long as making the samples.
bool above_water(const Scene& scene) {
  return scene.seafloor.kind == SeafloorKind::fractal && scene.track.kind != TrackKind::file &&
         scene.track.altitude_m >= scene.seafloor.depth_m;
}

std::string why_empty(const Recipe& recipe, std::string_view split) {
  const SplitOptions& options = recipe.options().split;
  const bool held_out = (split == "val" && !options.held_out_val.empty()) ||
                        (split == "test" && !options.held_out_test.empty());
  return held_out ? fmt::format(
                        "no sample is in it by dataset.split.held_out_{}; use more "
                        "seafloors or another seed, or correct the values",
                        split)
                  : "the split of each seafloor is drawn; use more samples, another seed, or other "
                    "shares in [dataset.split]";
}

/// --dry-run: draws all samples, but makes none.
void rehearse(const Recipe& recipe, const GenerateArguments& arguments, const Shard& shard) {
  std::map<std::string, std::size_t> splits;
  std::size_t failed = 0;
  bool unnamed = false;
  std::vector<std::size_t> shallow;  // their numbers
  ChipForecast chips;
  print_warnings(recipe.warnings());
  for (std::size_t i = 0; i < recipe.samples(); ++i) try {
      const SampleScene sample = recipe.sample(i);
      ++splits[sample.split];
      unnamed |= std::ranges::count(sample.scene.objects, ObjectOptions{}.class_name,
                                    &ObjectOptions::class_name) > 1;
      if (above_water(sample.scene)) shallow.push_back(i);
      const ChipForecast its = forecast_chips(recipe.options(), sample.scene);
      chips.chips += its.chips;
      chips.without_target += its.without_target;
    } catch (const SceneError& error) {
      if (++failed <= 10) print_note("ensonify: {}\n", error.what());
    }
  for (const std::string& split : splits_of(recipe.options().split))
    if (failed == 0 && !splits.contains(split))
      print_warning(fmt::format("the split {} is empty: {}", split, why_empty(recipe, split)));
  if (unnamed)
    print_warning("several objects have the class 'object': name them with objects.N.class");
  if (!shallow.empty())
    print_warning(fmt::format(
        "in {} of {} samples (the first is {}) the vehicle would leave the water, because "
        "track.altitude_m is not less than seafloor.depth_m; generate refuses a sample whose "
        "vehicle does so over its bed",
        shallow.size(), recipe.samples(), shallow.front()));
  if (chips.without_target > 0)
    print_warning(fmt::format(
        "{} of {} chips about objects will show less of them than dataset.least_visible = {}, by "
        "the sizes of chips and objects: {}",
        chips.without_target, chips.chips, recipe.options().min_visible, larger_chips));
  const ShardState state = shard_state(recipe, arguments.folder, shard);
  print_object({{"samples", recipe.samples()},
                {"seafloors", recipe.seafloors()},
                {"splits", splits},
                {"classes", recipe.class_names()},
                {"sediments", recipe.material_names()},
                {"refused", failed},
                {"above_water", shallow},
                {"chips_without_target", chips.without_target},
                {"shard", {{"samples", state.samples}, {"finished", state.finished}}}});
  if (failed > 0)
    throw UsageError(
        fmt::format("{} of {} samples draw values that a scene cannot have; change the recipe",
                    failed, recipe.samples()));
}

void generate_dataset(const GenerateArguments& arguments) {
  const Shard shard = parse_shard("--shard", arguments.shard);
  const Recipe recipe(arguments.recipe, arguments.data_folder, arguments.overrides);
  if (arguments.dry_run) return rehearse(recipe, arguments, shard);
  print_warnings(recipe.warnings());
  const int threads = refine::thread_count(arguments.threads);
  const GenerateReport report = watched(arguments.quiet, [&](const auto& progress) {
    return generate(recipe, arguments.folder,
                    {.threads = threads,
                     .shard = shard,
                     .cache = arguments.cache,
                     .memory = arguments.memory,
                     .progress = std::bind_front(progress, "samples"),
                     .failed = [](std::size_t sample, std::string_view why) {
                       print_note("ensonify: sample {} failed: {}\n", sample, why);
                     }});
  });
  print_warnings(report.extrapolation.appended_to(report.warnings));
  if (!arguments.quiet) print_report(report, arguments.folder, threads);
  if (arguments.json) print_json(recipe, report, arguments.folder, threads);
  if (report.stopped)
    throw Interrupted(fmt::format(
        "interrupted; finished samples stay, and the same command continues from there"));
  if (!report.failed.empty())
    throw SomeFailed(fmt::format("{} of {} samples failed; the same command tries them again",
                                 report.failed.size(), report.samples));
}

}  // namespace

void add_generate(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<GenerateArguments>();
  CLI::App& command =
      *app.add_subcommand("generate", "Make a dataset from its recipe, or continue making it");
  command
      .add_option("RECIPE", arguments->recipe,
                  "A recipe (`ensonify dump-default generate` prints one)")
      ->required();
  add_output(command, arguments->folder, "DIR", "The dataset's folder, created if missing")
      ->required();
  add_value(command, "--shard", arguments->shard, "I/N",
            "Make only shard I of N, counting from 0: to divide the samples among machines");
  add_overrides(command, arguments->overrides);
  add_threads(command, arguments->threads);
  add_memory(command, arguments->memory);
  add_data(command, arguments->data_folder);
  add_cache(command, arguments->cache);
  command.add_flag("--dry-run", arguments->dry_run,
                   "Draw all samples, print what would be made and what is finished, and make "
                   "nothing. Reports invalid scenes, and vehicles above the water over a bed at "
                   "its mean depth");
  command.add_flag("--json", arguments->json, "Print what was made, and the times, on stdout");
  add_quiet(command, arguments->quiet);
  command.callback(
      [&action, arguments] { action = [arguments] { generate_dataset(*arguments); }; });
}

}  // namespace ensonify::engine::app
