#include <ensonify/engine/base/lower_case.h>
#include <ensonify/engine/dataset/preview.h>
#include <ensonify/engine/output/png.h>
#include <ensonify/engine/output/staging.h>
#include <ensonify/engine/run/files_read.h>
#include <ensonify/refine/atomic_file.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "app.h"
#include "progress.h"

namespace ensonify::engine::app {
namespace {

namespace fs = std::filesystem;

struct PreviewArguments {
  fs::path recipe, file, data_folder, cache;
  std::vector<std::string> overrides;
  MemoryLimit memory;
  int samples = 16, threads = 0;
  bool quiet = false;
};

void make_preview(const PreviewArguments& arguments) {
  if (lower_case(arguments.file.extension().string()) != ".png")
    throw UsageError(fmt::format("{}: a contact sheet is written as PNG, expected FILE.png",
                                 arguments.file.string()));
  const Recipe recipe(arguments.recipe, arguments.data_folder, arguments.overrides);
  std::vector<fs::path> read{arguments.recipe};
  for (const std::string& asset : recipe.assets()) read.push_back(recipe.path_of(asset));
  require_not_read(arguments.file, read);
  const fs::path place = fs::absolute(arguments.file);
  // The folder for the samples' files. The claim removes the files of a preview that was killed.
  const std::optional<Claim> claim = StagingFolder::try_claim(place);
  if (!claim)
    throw UsageError(
        fmt::format("{}: another process makes this picture; wait until it has finished, or choose "
                    "another file with -o",
                    arguments.file.string()));
  const StagingFolder scratch(place);
  const std::size_t wanted =
      std::min(static_cast<std::size_t>(arguments.samples), recipe.samples());
  const ContactSheet sheet = watched(arguments.quiet, [&](const auto& progress) {
    return preview(recipe, wanted,
                   {.threads = arguments.threads,
                    .cache = arguments.cache,
                    .memory = arguments.memory,
                    .scratch = scratch.path(),
                    .progress = std::bind_front(progress, "samples")});
  });
  refine::write_file(arguments.file, encode_png(sheet.picture));
  if (sheet.samples < wanted)
    throw Stopped(fmt::format("stopped after {} of {} samples, which are in {}", sheet.samples,
                              wanted, arguments.file.string()));
}

}  // namespace

void add_preview(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<PreviewArguments>();
  CLI::App& command = *app.add_subcommand(
      "preview",
      "Draw a contact sheet of a recipe's samples and their labels. Ctrl-C ends it, and the sheet "
      "then shows the samples that are finished");
  command.add_option("RECIPE", arguments->recipe, "A recipe, as for generate")->required();
  add_output(command, arguments->file, "FILE.png", "The picture")->required();
  add_value(command, "-n", arguments->samples, "N",
            "Number of samples (default: 16; at most those of the recipe)")
      ->check(CLI::Range(1, 1000));
  add_overrides(command, arguments->overrides);
  add_threads(command, arguments->threads);
  add_data(command, arguments->data_folder);
  add_cache(command, arguments->cache);
  add_memory(command, arguments->memory);
  command.add_flag("--quiet", arguments->quiet, "No progress; errors remain");
  command.callback([&action, arguments] { action = [arguments] { make_preview(*arguments); }; });
}

}  // namespace ensonify::engine::app
