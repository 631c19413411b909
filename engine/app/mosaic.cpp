#include <ensonify/engine/base/lower_case.h>
#include <ensonify/engine/mosaic/mosaic.h>

#include <memory>

#include <fmt/format.h>

#include <ensonify/engine/run/files_read.h>
#include <ensonify/engine/run/output_folder.h>

#include "app.h"
#include "progress.h"

namespace ensonify::engine::app {
namespace {

struct MosaicArguments {
  std::vector<std::filesystem::path> runs;
  std::filesystem::path file;
  MosaicOptions options;
  bool quiet = false;
};

void write_mosaic(const MosaicArguments& arguments) {
  if (const std::string kind = lower_case(arguments.file.extension().string());
      kind != ".tif" && kind != ".tiff")
    throw UsageError(
        fmt::format("{}: a mosaic is written as .tif, not as '{}'", arguments.file.string(), kind));
  for (const std::filesystem::path& run : arguments.runs)
    require_not_read(arguments.file, files_of_run(run));
  const MosaicReport report = watched(arguments.quiet, [&](const auto& progress) {
    MosaicOptions options = arguments.options;
    options.progress = progress;
    return make_mosaic(arguments.runs, arguments.file, options);
  });
  if (!arguments.quiet)
    print_note("{}: {} x {} pixels of {:g} m from {} pings; {}\n", arguments.file.string(),
               report.columns, report.rows, report.pixel_m, report.pings,
               report.has_reference ? "with a coordinate reference system"
                                    : "local metres, without a coordinate reference system");
}

}  // namespace

void add_mosaic(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<MosaicArguments>();
  MosaicOptions& options = arguments->options;
  CLI::App& command = *app.add_subcommand(
      "mosaic", "Lay one sonar of one or several runs on the ground, as a GeoTIFF");
  command.add_option("RUN", arguments->runs, "Folders that `ensonify run` wrote")->required();
  add_output(command, arguments->file, "FILE", "The file to write: .tif")->required();
  add_value(command, "--sonar", options.sonar, "NAME", "The sonar (default: the only one)");
  add_value(command, "--pixel-m", options.pixel_m, "SIZE",
            "Size of a pixel (default: the length of a bin or the spacing of pings, the "
            "larger, rounded)")
      ->check(number(1e-9, 1e6));
  command
      .add_option_function<std::string>(
          "--positions",
          [&options](const std::string& word) {
            options.positions = word == "truth" ? Positions::truth : Positions::navigation;
          },
          "truth: where each echo came from (default). navigation: as software for "
          "recordings does it, from the reported pose and the altitude, over a level bed")
      ->check(one_of({"truth", "navigation"}))
      ->type_name("truth|navigation");
  add_value(command, "--layer", options.layer, "NAME",
            "brightness (default): samples, even over range, 1 to 255, 0 for no data; or a "
            "layer of the images: sample, intensity, intensity_mean (NaN for no data), "
            "region, sediment, class, instance (65535 for no data)")
      ->check(one_of({mosaic_layers.begin(), mosaic_layers.end()}));
  command
      .add_option_function<std::string>(
          "--overlap",
          [&options](const std::string& word) {
            options.overlap = word == "newest" ? Overlap::newest
                              : word == "mean" ? Overlap::mean
                                               : Overlap::nearest;
          },
          "What is shown where pings overlap: the newest (default: the last in the order "
          "of the runs), the mean, or the one from the nearest ground range")
      ->check(one_of({"newest", "mean", "nearest"}))
      ->type_name("newest|mean|nearest");
  command.add_flag("--quiet", arguments->quiet, "No progress and no summary; errors remain");
  command.callback([&action, arguments] { action = [arguments] { write_mosaic(*arguments); }; });
}

}  // namespace ensonify::engine::app
