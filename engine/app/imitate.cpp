#include <ensonify/engine/imitation/imitate.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/output/staging.h>
#include <ensonify/engine/recording/recording_reader.h>
#include <ensonify/refine/atomic_file.h>

#include "app.h"
#include "progress.h"

namespace ensonify::engine::app {
namespace {

namespace fs = std::filesystem;

struct ImitateArguments {
  std::vector<fs::path> recordings;
  fs::path folder;
  std::size_t line = 0;
  int threads = 0;
  bool recipe = false, json = false, quiet = false;
};

RecordedLine chosen_line(const ImitateArguments& arguments) {
  std::vector<RecordedLine> lines = read_recordings(arguments.recordings);
  const std::size_t number = arguments.line == 0 && lines.size() == 1 ? 1 : arguments.line;
  if (number < 1 || number > lines.size()) {
    const std::string file = arguments.recordings.front().string();
    throw UsageError(
        lines.size() == 1
            ? fmt::format("{}: has one line: leave --line out", file)
            : fmt::format(
                  "{}: has {} lines, expected --line 1 to {} for one of them; see recording-info",
                  file, lines.size(), lines.size()));
  }
  return std::move(lines[number - 1]);
}

/// A text as a field of CSV: in quotes if it needs them.
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n") == text.npos) return text;
  std::string field = "\"";
  for (const char c : text) field += c == '"' ? "\"\"" : std::string(1, c);
  return field + '"';
}

std::string summary(const Imitation& made) {
  std::string text = "key,value,how,why\n";
  for (const FoundKey& key : found_keys(made.model)) {
    text += fmt::format("{},{},{},{}\n", key.name(),
                        key.value.starts_with('"') ? key.value : csv_field(key.value),
                        name_of(key.evidence.how), csv_field(key.evidence.why));
  }
  return text;
}

/// Removes, at its end, those of these folders that are empty.
struct NewFolders {
  std::vector<fs::path> made;
  ~NewFolders() { refine::remove_empty(made); }
};

nlohmann::ordered_json as_json(const Imitation& made, const fs::path& folder) {
  nlohmann::ordered_json keys = nlohmann::ordered_json::object(),
                         statistics = nlohmann::ordered_json::object();
  for (const FoundKey& key : found_keys(made.model))
    keys[key.name()] = {
        {"value", key.value}, {"how", name_of(key.evidence.how)}, {"why", key.evidence.why}};
  for (const ComparedStatistic& one : made.statistics)
    statistics[one.name] = {
        {"recording", one.a}, {"imitation", one.b}, {"spread", one.spread}, {"ratio", one.ratio()}};
  const Likeness alike = likeness(made.statistics);
  return {{"folder", folder.string()},
          {"keys", keys},
          {"materials", made.materials},
          {"unknown", made.unknown},
          {"statistics", statistics},
          {"level_over_angle_off_db", alike.level_over_grazing_db},
          {"level_over_range_off_db", alike.level_over_range_db},
          {"contrast_off_db", alike.contrast_db}};
}

void make_imitation(const ImitateArguments& arguments) {
  const auto require_new = [&] {
    if (fs::exists(arguments.folder))
      throw UsageError(fmt::format("{}: exists already; choose another folder, or remove it",
                                   arguments.folder.string()));
  };
  require_new();
  const RecordedLine line = chosen_line(arguments);
  print_warnings(line.warnings);
  fs::path folder = fs::absolute(arguments.folder);
  if (folder.filename().empty()) folder = folder.parent_path();  // a slash at the end
  const NewFolders above{refine::make_folder(folder.parent_path())};
  // The claim also removes what a killed process has left of this folder.
  const std::optional<Claim> claim = StagingFolder::try_claim(folder);
  if (!claim)
    throw UsageError(
        fmt::format("{}: another process makes this folder; wait until it has finished, or choose "
                    "another folder with -o",
                    arguments.folder.string()));
  require_new();
  StagingFolder staging(folder);
  const std::string file = arguments.recordings.front().string();
  const Imitation made = watched(arguments.quiet, [&](const auto& progress) {
    try {
      return imitate(line, staging.path(), {.threads = arguments.threads, .progress = progress});
    } catch (const RecordingError& error) {
      throw RecordingError(fmt::format("{}: {}", file, error.what()));
    } catch (const SceneError& error) {
      throw SceneError(fmt::format("{}: {}", file, error.what()));
    }
  });
  const std::string name = arguments.recordings.front().filename().string();
  refine::write_file(staging.path() / "report.html", imitation_page(name, made));
  if (arguments.recipe) refine::write_file(staging.path() / "recipe.toml", recipe_text(made.model));
  staging.put_in_place();
  if (arguments.json)
    print_object(as_json(made, arguments.folder));
  else
    print(summary(made));
  if (arguments.quiet) return;
  for (const std::string& what : made.unknown) print_note("not known: {}\n", what);
  const Likeness alike = likeness(made.statistics);
  print_note(
      "{} of {} statistics of pings that the fit did not see differ by no more than the "
      "recording's halves; {}; scene and report are in {}\n",
      alike.within, alike.known, alike.decibels(), arguments.folder.string());
}

}  // namespace

void add_imitate(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<ImitateArguments>();
  CLI::App& command = *app.add_subcommand(
      "imitate",
      "Make a scene that looks like a recorded line (XTF, JSF). Writes scene.toml with the files it "
      "needs, and report.html. Prints each key, its value and the evidence");
  command.add_option("RECORDING", arguments->recordings, "The recording's files, in their order")
      ->required();
  add_output(command, arguments->folder, "DIR", "The folder to make")->required();
  add_value(command, "--line", arguments->line, "N",
            "Which line of a recording with several sonars, from 1")
      ->check(CLI::Range(std::size_t{1}, std::size_t{1000000000}));
  command.add_flag("--recipe", arguments->recipe,
                   "Also write recipe.toml: a dataset with distributions about what was found");
  add_threads(command, arguments->threads);
  command.add_flag("--json", arguments->json, "Print one JSON object; unknown numbers are null");
  add_quiet(command, arguments->quiet);
  command.callback([&action, arguments] { action = [arguments] { make_imitation(*arguments); }; });
}

}  // namespace ensonify::engine::app
