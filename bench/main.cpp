#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/refine/atomic_file.h>
#include <ensonify/refine/read_file.h>

#include "compare.h"
#include "html.h"
#include "report.h"
#include "temporary_folder.h"

namespace {

namespace fs = std::filesystem;
using namespace ensonify;
using namespace ensonify::bench;

struct Arguments {
  GridOptions grid;
  int rounds = 5, pings = 40;
  fs::path json, csv, html, compare;
  bool print_json = false;
};

void write(const fs::path& file, const std::string& text) {
  if (!file.empty()) refine::write_file(file, std::as_bytes(std::span(text)));
}

nlohmann::ordered_json read(const fs::path& file) {
  try {
    return nlohmann::ordered_json::parse(refine::read_user_file<std::runtime_error>(file));
  } catch (const nlohmann::ordered_json::exception& error) {
    throw std::runtime_error(fmt::format("{}: {}", file.string(), error.what()));
  }
}

int measure_all(const Arguments& arguments) {
  const std::string& pattern = arguments.grid.pattern;
  const int rounds = arguments.rounds, pings = arguments.pings;
  Results results{.cells = measure_grid(arguments.grid),
                  .runs = measure_pipeline(pattern, arguments.grid.quick, arguments.grid.progress)};
  if (!arguments.grid.quick) {
    results.traces = measure_traces(pattern, arguments.grid.data, rounds, pings);
    results.refinements = measure_refinement(pattern);
    results.costs = measure_costs(pattern, arguments.grid.data, rounds, pings);
  }
  if (std::ranges::any_of(results.cells,
                          [](const Cell& cell) { return cell.ping_ms.median > 0.0; }))
    results.harness = measure_harness(results.cells);
  if (results.empty()) {
    fmt::print(stderr, "ensonify-bench: no case's name contains '{}'{}\n", pattern,
               arguments.grid.quick ? "; --quick has only ping/, run/ and dataset/" : "");
    return 2;
  }
  const nlohmann::ordered_json report = to_json(results);
  const std::string text = report.dump(2) + "\n";
  write(arguments.json, text);
  write(arguments.csv, csv(results));
  write(arguments.html, html(report));
  fmt::print("{}", arguments.print_json ? text : table(results));
  if (std::fflush(stdout) != 0 || std::ferror(stdout))
    throw std::runtime_error("stdout cannot be written");
  int code = 0;
  for (const Cell& cell : results.cells)
    if (!cell.agrees()) {
      fmt::print(stderr, "ensonify-bench: {} disagrees with the reference\n", cell.name);
      code = 1;
    }
  if (results.harness && results.harness->share() > Harness::max_share) {
    fmt::print(stderr, "ensonify-bench: {}: too much for a valid measurement of that cell\n",
               words(*results.harness));
    code = 1;
  }
  if (results.harness && !results.harness->stages_are_of_pings())
    fmt::print(stderr,
               "ensonify-bench: the times of the stages add up to {:.0f} % of the pings': other "
               "programs ran, and only the times of whole pings are valid\n",
               100.0 * results.harness->stages_over_ping.median);
  if (!arguments.compare.empty()) {
    Comparison comparison = compare(read(arguments.compare), report);
    std::erase_if(comparison.only_before, [&](const std::string& name) {
      return name.find(pattern) == std::string::npos;  // not measured now
    });
    fmt::print(stderr, "{}", table(comparison));
    if (comparison.changes.empty()) {
      fmt::print(stderr, "ensonify-bench: {} has none of the cases that were measured\n",
                 arguments.compare.string());
      return 2;
    }
    if (std::ranges::any_of(comparison.changes, &Change::fell)) code = 1;
  }
  return code;
}

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app("Times pings of ensonify, case by case: face sources x intersectors x beds x sizes");
  Arguments arguments;
  bool quiet = false;
  app.add_option(
      "--filter", arguments.grid.pattern,
      "Only cases whose name contains this, such as ping/smooth/2M, trace/, run/ or dataset/");
  CLI::Option* const quick =
      app.add_flag("--quick", arguments.grid.quick,
                   "Small beds and few measurements, without traces: about a minute");
  app.add_option("--data", arguments.grid.data, "Folder with the wreck and the survey")
      ->type_name("DIR")
      ->envname("ENSONIFY_DATA");
  app.add_option("--cache", arguments.grid.cache,
                 "Folder for analysed seafloors (default: a new one, so that preparing them is "
                 "measured)")
      ->type_name("DIR")
      ->envname("ENSONIFY_CACHE");
  app.add_option("--rounds", arguments.rounds, "Rounds through the traces and costs")
      ->check(CLI::Range(1, 1000))
      ->excludes(quick);
  app.add_option("--pings", arguments.pings, "Pings per round")
      ->check(CLI::Range(1, 1000))
      ->excludes(quick);
  app.add_option("--json-file", arguments.json, "Write the report as JSON")->type_name("FILE");
  app.add_option("--csv", arguments.csv, "Write the grid's cells and the runs as CSV")
      ->type_name("FILE");
  app.add_option("--html", arguments.html, "Write the report as an HTML page")->type_name("FILE");
  app.add_option(
         "--compare", arguments.compare,
         "Compare with an older JSON report: exit code 1 if a speedup fell by more than the noise")
      ->type_name("FILE");
  app.add_flag("--json", arguments.print_json, "Print JSON instead of a table");
  app.add_flag("--quiet", quiet, "Print no progress");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    if (!arguments.compare.empty()) {  // fails before the long measurement
      const nlohmann::ordered_json older = read(arguments.compare);
      compare(older, older);
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "ensonify-bench: {}\n", error.what());
    return 2;
  }
  if (!quiet)
    arguments.grid.progress = [](std::string_view what) { fmt::print(stderr, "{}\n", what); };
  if (!arguments.grid.cache.empty()) return measure_all(arguments);
  const TemporaryFolder cache;
  arguments.grid.cache = cache.path();
  return measure_all(arguments);
} catch (const std::exception& error) {
  fmt::print(stderr, "ensonify-bench: {}\n", error.what());
  return 1;
}
