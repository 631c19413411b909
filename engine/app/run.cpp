#include <ensonify/engine/output/exr.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/run/files_read.h>
#include <ensonify/engine/trace/face_source.h>
#include <ensonify/engine/trace/intersector.h>
#include <ensonify/refine/parallel_for.h>

#include <sys/utsname.h>

#include <memory>
#include <optional>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app.h"
#include "progress.h"

namespace ensonify::engine::app {
namespace {

namespace fs = std::filesystem;

struct RunArguments {
  SceneArguments scene;
  fs::path folder;
  std::optional<std::string> surface, intersector, seed;
  int threads = 0;
  MemoryLimit memory;
  fs::path cache;
  bool json = false, quiet = false;
  std::size_t verify = 0;
  std::string part = "0/1";
};

double pings_per_s(const RunReport& report) {
  return static_cast<double>(report.counts.at("pings")) / report.pings_s;
}

void print_size(const RunSize& size) {
  constexpr double gb = 1e9;
  print_note(
      "{} pings in {} parts, of which {} are finished; the others need at most {:.3g} GB on "
      "the disk, and {:.2g} GB of memory for the images\n",
      size.pings, size.parts, size.finished_parts, size.max_disk_bytes / gb,
      size.memory_bytes / gb);
}

void print_report(const RunReport& report, const std::string& intersector, const fs::path& folder,
                  int threads) {
  const StageTimes& stages = report.stages;
  const SeafloorOrigin& origin = report.origin;
  if (!origin.why.empty()) print_note("surface: {}, because {}\n", origin.surface, origin.why);
  if (origin.cached)
    print_note("analysed seafloor: read from {}\n", origin.cache_file.string());
  else if (!origin.cache_file.empty() && origin.surface != static_surface)
    print_note("analysed seafloor: kept in {}\n", origin.cache_file.string());
  // Parts that existed before took no time in this run.
  const std::string rate = report.parts_found > 0
                               ? fmt::format(" for the missing ones of {} parts", report.parts)
                               : fmt::format(": {:.4g} pings/s", pings_per_s(report));
  print_note(
      "{} pings in {:.2f} s{} on {} thread{}; seafloor {:.2f} s, files {:.2f} s\n"
      "by stage, summed over threads: surface {:.2f} s, trace {:.2f} s, echo {:.2f} s, receiver "
      "{:.2f} s\n",
      report.counts.at("pings"), report.pings_s, rate, threads, threads == 1 ? "" : "s",
      report.prepare_s, report.files_s, stages.surface_s, stages.trace_s, stages.echo_s,
      stages.receive_s);
  if (intersector_kind(intersector).builds_tree)
    print_note(
        "intersector: {}; the default, fan_scan, with --surface footprint makes 1.1 to 5 "
        "times as many pings per second: the gain is larger with fewer faces\n",
        intersector);
  // If no part was made in this share of the run, there are no counts.
  if (const auto rays = report.counts.find("rays"); rays != report.counts.end() && rays->second > 0)
    print_note(
        "sampling: {:.0f} rays per ping, of which {:.0f} % hit; {} bins starved\n",
        static_cast<double>(rays->second) / static_cast<double>(report.counts.at("pings")),
        100.0 * static_cast<double>(report.counts.at("hits")) / static_cast<double>(rays->second),
        report.counts.at("starved_bins"));
  if (const auto bent = report.counts.find("bent_rays"); bent != report.counts.end())
    print_note("bent rays: {}, of which {} by chords\n", bent->second,
               report.counts.at("bent_rays_by_chords"));
  if (!report.verification.empty())
    print_note("verified: {} rays of {} pings, {} different from the reference, {} unexplained\n",
               report.verification.at("rays"), report.verification.at("pings"),
               report.verification.at("rays") - report.verification.at("same"),
               report.verification.at("unexplained"));
  if (!report.complete)
    print_note("the run has {} parts; when all are made, `ensonify merge {}` completes it\n",
               report.parts, folder.string());
  for (const fs::path& file : report.files)
    if (file.extension() == ".png" && file.parent_path() == folder)
      print_note("picture: {}\n", file.string());
}

void print_json(const RunReport& report, const fs::path& folder, int threads) {
  const StageTimes& stages = report.stages;
  std::vector<std::string> files;
  for (const fs::path& file : report.files) files.push_back(file.string());
  utsname system{};
  uname(&system);
  nlohmann::ordered_json json = {
      {"folder", folder.string()},
      {"files", files},
      {"parts",
       {{"of_run", report.parts}, {"found", report.parts_found}, {"complete", report.complete}}},
      {"counts", report.counts},
      {"warnings", report.extrapolation.appended_to(report.warnings)},
      {"surface", {{"name", report.origin.surface}, {"why", report.origin.why}}},
      {"cache", {{"file", report.origin.cache_file.string()}, {"hit", report.origin.cached}}},
      {"pings_per_s", report.parts_found > 0 || report.counts.at("pings") == 0
                          ? nlohmann::ordered_json(nullptr)
                          : nlohmann::ordered_json(pings_per_s(report))},
      {"times_s",
       {{"seafloor", report.prepare_s}, {"pings", report.pings_s}, {"files", report.files_s}}},
      {"stages_s",  // summed over threads
       {{"surface", stages.surface_s},
        {"trace", stages.trace_s},
        {"echo", stages.echo_s},
        {"receiver", stages.receive_s},
        {"speckle", stages.receive_s}}},  // the same value under the key that existing readers use
      {"threads", threads},
      {"host",
       {{"name", system.nodename},
        {"system", fmt::format("{} {}", system.sysname, system.release)},
        {"machine", system.machine},
        {"cores", std::thread::hardware_concurrency()}}},
  };
  if (!report.verification.empty()) json["verification"] = report.verification;
  print_object(json);
}

void run_scene(RunArguments arguments) {
  std::vector<std::string>& overrides = arguments.scene.overrides;
  if (arguments.surface) overrides.push_back("run.surface=" + *arguments.surface);
  if (arguments.intersector) overrides.push_back("run.intersector=" + *arguments.intersector);
  if (arguments.seed) overrides.push_back("seed=" + *arguments.seed);
  const Scene scene = arguments.scene.read();
  if (arguments.folder.empty()) arguments.folder = arguments.scene.file.stem().string() + "-run";
  require_not_read(scene, arguments.folder, {&arguments.scene.file, 1});
  const int threads = refine::thread_count(arguments.threads);

  set_exr_threads(threads);
  RunReport report;
  try {
    report = watched(arguments.quiet, [&](const auto& progress) {
      return run(scene, arguments.folder,
                 {.threads = threads,
                  .progress = progress,
                  .cache = arguments.cache,
                  .memory = arguments.memory,
                  .verify_pings = arguments.verify,
                  .shard = parse_shard("--part", arguments.part),
                  .on_parts = [&](const RunSize& size) {
                    if (!arguments.quiet) print_size(size);
                  }});
    });
  } catch (const Stopped&) {
    if (arguments.json) print_object({{"folder", arguments.folder.string()}, {"stopped", true}});
    throw;
  }
  print_warnings(report.extrapolation.appended_to(report.warnings));
  if (!arguments.quiet && report.counts.at("pings") > 0)
    print_report(report, scene.run.intersector, arguments.folder, threads);
  if (arguments.json) print_json(report, arguments.folder, threads);
  if (!report.verification.empty() && report.verification.at("unexplained") > 0)
    throw std::runtime_error(fmt::format(
        "{} of {} rays of {} pings differ from the exact reference without an explanation; the "
        "classes are in {}, and `ensonify check` lists the rays",
        report.verification.at("unexplained"), report.verification.at("rays"),
        report.verification.at("pings"), (arguments.folder / "manifest.json").string()));
}

}  // namespace

void add_run(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<RunArguments>();
  CLI::App& command = *app.add_subcommand("run", "Simulate a scene and write its sidescan images");
  arguments->scene.add_to(command);
  add_output(command, arguments->folder, "DIR",
             "The folder for the files, created if missing (default: the scene's name with "
             "-run appended, in the current folder)");
  add_value(command, "--surface", arguments->surface, "NAME",
            "The same as -D run.surface=NAME: auto, static, refined or footprint");
  add_value(command, "--intersector", arguments->intersector, "NAME",
            "The same as -D run.intersector=NAME; `ensonify intersectors` lists them");
  add_value(command, "--seed", arguments->seed, "S", "The same as -D seed=S");
  add_value(command, "--part", arguments->part, "I/N",
            "Make share I of N of the parts of a run in several parts, counting from 0; "
            "`ensonify merge DIR` completes the run");
  add_value(command, "--verify", arguments->verify, "N",
            "Compare N pings, spread over the track, with the exact reference; the manifest "
            "counts the differences by class; exit code 1 if one is unexplained")
      ->check(CLI::Range(std::size_t{1}, std::size_t{1000000000}));
  add_cache(command, arguments->cache);
  add_threads(command, arguments->threads);
  add_memory(command, arguments->memory);
  command.add_flag("--json", arguments->json, "Print counts, files, times and host on stdout");
  add_quiet(command, arguments->quiet);
  command.callback([&action, arguments] { action = [arguments] { run_scene(*arguments); }; });
}

}  // namespace ensonify::engine::app
