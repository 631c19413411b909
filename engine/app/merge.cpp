#include <ensonify/engine/dataset/merge.h>
#include <ensonify/engine/run.h>

#include <algorithm>
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app.h"
#include "progress.h"

namespace ensonify::engine::app {
namespace {

constexpr std::size_t max_lines = 10;

struct Arguments {
  std::filesystem::path folder;
  bool json = false, quiet = false;
};

/// Ascending numbers as text, for example "3, 5 to 9, 12".
std::string intervals(const std::vector<std::size_t>& numbers) {
  std::string text;
  for (std::size_t i = 0, j; i < numbers.size(); i = j + 1) {
    for (j = i; j + 1 < numbers.size() && numbers[j + 1] == numbers[j] + 1;) ++j;
    text += fmt::format("{}{}", text.empty() ? "" : ", ", numbers[i]);
    if (j > i) text += fmt::format(" to {}", numbers[j]);
  }
  return text;
}

void merge_parts(const Arguments& arguments) {
  RunMergeReport report;
  {
    const SignalWatch signals;
    Progress progress(arguments.quiet);
    report = merge_run(arguments.folder, [&](std::size_t done, std::size_t of) {
      progress.report("parts", done, of);
      return SignalWatch::caught() == 0;
    });
  }
  for (std::size_t i = 0; i < std::min(max_lines, report.damaged.size()); ++i)
    fmt::print(stderr, "ensonify: {}\n", report.damaged[i]);
  if (arguments.json)
    print_object({{"parts", report.parts},
                  {"missing", report.missing},
                  {"damaged", report.damaged},
                  {"warnings", report.warnings}});
  if (!report.missing.empty() || !report.damaged.empty())
    throw std::runtime_error(fmt::format(
        "{}: {}{}{}nothing was written; remove the folders of damaged parts and run `ensonify run` "
        "again",
        arguments.folder.string(),
        report.missing.empty() ? ""
                               : fmt::format("parts {} are missing; ", intervals(report.missing)),
        report.damaged.empty() ? "" : fmt::format("{} files are damaged", report.damaged.size()),
        report.damaged.empty() ? "" : "; "));
  print_warnings(report.warnings);
  if (!arguments.quiet)
    fmt::print(stderr, "{}: {} parts are complete\n", arguments.folder.string(), report.parts);
}

void merge_dataset(const Arguments& arguments) {
  MergeReport report;
  {
    const SignalWatch signals;
    Progress progress(arguments.quiet);
    report = merge(arguments.folder, [&](std::size_t done, std::size_t of) {
      progress.report("samples", done, of);
      return SignalWatch::caught() == 0;
    });
  }
  for (std::size_t i = 0; i < std::min(max_lines, report.damaged.size()); ++i)
    fmt::print(stderr, "ensonify: {}\n", report.damaged[i]);
  if (arguments.json)
    print_object({{"samples", report.samples},
                  {"missing", report.missing},
                  {"damaged", report.damaged},
                  {"warnings", report.warnings},
                  {"splits", report.samples_by_split},
                  {"images", report.images}});
  if (!report.missing.empty() || !report.damaged.empty())
    throw std::runtime_error(fmt::format(
        "{}: {}{}{}nothing was written; remove damaged samples and run `ensonify generate` again",
        arguments.folder.string(),
        report.missing.empty() ? ""
                               : fmt::format("samples {} are missing; ", intervals(report.missing)),
        report.damaged.empty() ? "" : fmt::format("{} samples are damaged", report.damaged.size()),
        report.damaged.empty() ? "" : "; "));
  print_warnings(report.warnings);
  if (arguments.quiet) return;
  fmt::print(stderr, "{}: {} samples are complete\n", arguments.folder.string(), report.samples);
  for (const auto& [group, count] : report.images)
    fmt::print(stderr, "{}: {} images\n", group, count);
  fmt::print(stderr, "card: {}\n", (arguments.folder / "README.md").string());
}

}  // namespace

void add_merge(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App& command = *app.add_subcommand(
      "merge",
      "Check every file of a dataset, and write its indexes, splits and card; or check every file "
      "of a run in parts, and write what the whole run has");
  command
      .add_option("DIR", arguments->folder,
                  "A folder made by `ensonify generate`, or by `ensonify run` in parts")
      ->required();
  command.add_flag("--json", arguments->json, "Print what was found on stdout");
  command.add_flag("--quiet", arguments->quiet,
                   "No progress and no summary; warnings and errors remain");
  command.callback([&action, arguments] {
    action = [arguments] {
      if (is_run_in_parts(arguments->folder))
        merge_parts(*arguments);
      else
        merge_dataset(*arguments);
    };
  });
}

}  // namespace ensonify::engine::app
