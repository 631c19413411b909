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

struct MergeArguments {
  std::filesystem::path folder;
  bool webdataset = false, json = false, quiet = false;
};

/// Ascending numbers as a text, for example "3, 5 to 9, 12".
std::string intervals(const std::vector<std::size_t>& numbers) {
  std::string text;
  for (std::size_t i = 0, j; i < numbers.size(); i = j + 1) {
    for (j = i; j + 1 < numbers.size() && numbers[j + 1] == numbers[j] + 1;) ++j;
    text += fmt::format("{}{}", text.empty() ? "" : ", ", numbers[i]);
    if (j > i) text += fmt::format(" to {}", numbers[j]);
  }
  return text;
}

/// If pieces are missing or damaged, prints the damage and throws std::runtime_error. `command`
/// makes missing pieces, but does not replace damaged ones. `holders`: what the pieces are in.
void require_whole(const MergeArguments& arguments, std::string_view pieces,
                   std::string_view holders, std::string_view command,
                   const std::vector<std::size_t>& missing,
                   const std::vector<std::string>& damaged) {
  if (missing.empty() && damaged.empty()) return;
  for (std::size_t i = 0; i < std::min(max_lines, damaged.size()); ++i)
    print_note("ensonify: {}\n", damaged[i]);
  std::string found;
  if (missing.size() == 1)
    found += fmt::format("{} {} is missing; ", pieces.substr(0, pieces.size() - 1), missing[0]);
  else if (!missing.empty())
    found += fmt::format("{} {} are missing; ", pieces, intervals(missing));
  if (!damaged.empty())
    found +=
        fmt::format("{} fault{} in {}; ", damaged.size(), damaged.size() == 1 ? "" : "s", pieces);
  throw std::runtime_error(fmt::format(
      "{}: {}nothing was written; {}run `{}` again", arguments.folder.string(), found,
      damaged.empty() ? "" : fmt::format("remove the {} of damaged {} and ", holders, pieces),
      command));
}

void merge_parts(const MergeArguments& arguments) {
  const RunMergeReport report = watched(arguments.quiet, [&](const auto& progress) {
    return merge_run(arguments.folder,
                     [&](std::size_t done, std::size_t of) { return progress("parts", done, of); });
  });
  if (arguments.json)
    print_object({{"parts", report.parts},
                  {"missing", report.missing},
                  {"damaged", report.damaged},
                  {"warnings", report.warnings}});
  require_whole(arguments, "parts", "folders", "ensonify run", report.missing, report.damaged);
  print_warnings(report.warnings);
  if (!arguments.quiet)
    print_note("{}: {} parts are complete\n", arguments.folder.string(), report.parts);
}

void merge_dataset(const MergeArguments& arguments) {
  const MergeReport report = watched(arguments.quiet, [&](const auto& progress) {
    return merge(arguments.folder, progress, {.webdataset = arguments.webdataset});
  });
  if (arguments.json)
    print_object({{"samples", report.samples},
                  {"missing", report.missing},
                  {"damaged", report.damaged},
                  {"warnings", report.warnings},
                  {"splits", report.samples_by_split},
                  {"images", report.images},
                  {"chips_without_target", report.chips_without_target}});
  require_whole(arguments, "samples", "folders or tars", "ensonify generate", report.missing,
                report.damaged);
  print_warnings(report.warnings);
  if (arguments.quiet) return;
  print_note("{}: {} samples are complete\n", arguments.folder.string(), report.samples);
  for (const auto& [group, count] : report.images) print_note("{}: {} images\n", group, count);
  print_note("card: {}\n", (arguments.folder / "README.md").string());
}

}  // namespace

void add_merge(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<MergeArguments>();
  CLI::App& command = *app.add_subcommand(
      "merge",
      "Check every file of a dataset, or of a run in parts, and complete it. A dataset gets its "
      "indexes, splits and card, a run the files of the whole run");
  command
      .add_option("DIR", arguments->folder,
                  "A folder made by `ensonify generate`, or by `ensonify run` in parts")
      ->required();
  command.add_flag("--webdataset", arguments->webdataset,
                   "Of a dataset: also write the pictures, masks and labels of each kind and split "
                   "into tars for WebDataset");
  command.add_flag("--json", arguments->json, "Print what was found on stdout");
  add_quiet(command, arguments->quiet);
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
