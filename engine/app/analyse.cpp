#include <algorithm>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/clock.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/seafloor/analysis.h>
#include <ensonify/engine/simulator/prepare.h>
#include <ensonify/engine/trace/face_source.h>
#include <ensonify/refine/parallel_for.h>
#include <ensonify/refine/tile_collapse.h>

#include "app.h"
#include "progress.h"

namespace ensonify::engine::app {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  SceneArguments scene;
  fs::path file;
  int threads = 0;
  MemoryLimit memory;
  bool json = false;
  bool quiet = false;
};

/// Reads the scene; for a mesh file, a scene whose seafloor is that mesh.
Scene read_input(const SceneArguments& input) {
  const std::string kind = input.file.extension().string();
  constexpr std::array meshes{".ply", ".obj", ".stl", ".off"};
  const auto same = [&](std::string_view mesh) {
    return std::ranges::equal(kind, mesh, {}, [](unsigned char c) { return std::tolower(c); });
  };
  if (std::ranges::none_of(meshes, same)) return input.read();
  if (!fs::exists(input.file))
    throw UsageError(fmt::format("{}: there is no such file", input.file.string()));
  const fs::path folder = input.file.parent_path();
  return parse_scene(
      fmt::format("version = 1\n[seafloor]\nkind = \"mesh\"\nmesh = {}\n",
                  toml_string(input.file.filename().string())),
      input.file.string(), input.overrides,
      {.scene_folder = folder.empty() ? "." : folder, .data_folder = input.data_folder});
}

void analyse_scene(const Arguments& arguments) {
  const Scene scene = read_input(arguments.scene);
  if (scene.seafloor.kind == SeafloorKind::progressive)
    throw UsageError(
        fmt::format("{}: its seafloor is already analysed", arguments.scene.file.string()));
  const int threads = refine::thread_count(arguments.threads);
  const SignalWatch signals;
  std::optional<Progress> progress(std::in_place, arguments.quiet);
  const auto report = [&](std::string_view stage) {
    if (SignalWatch::caught() != 0) throw Stopped("stopped on request; nothing was written");
    progress->report(stage, 0, 1);
  };

  report("seafloor");
  Clock::time_point start = Clock::now();
  Seafloor seafloor = seafloor_of(scene, {arguments.memory, refine::tile_collapse_bytes_per_face});
  const double seafloor_s = seconds_since(start);
  report("analysis");
  start = Clock::now();
  with_memory_for("the analysis of the seafloor", [&] { analyse(seafloor, threads); });
  const double analysis_s = seconds_since(start);
  report("file");
  start = Clock::now();
  save_analysed(seafloor, seafloor_key(scene), arguments.file);
  const double file_s = seconds_since(start);
  progress.reset();

  print_warnings(seafloor.warnings);
  const std::uintmax_t bytes = fs::file_size(arguments.file);
  if (!arguments.quiet)
    fmt::print(stderr,
               "{} vertices, {} faces: seafloor {:.2f} s, analysis {:.2f} s on {} thread{}, file "
               "{:.2f} s; {:.1f} bytes per vertex\n{}\n",
               seafloor.vertices, seafloor.faces, seafloor_s, analysis_s, threads,
               threads == 1 ? "" : "s", file_s,
               static_cast<double>(bytes) / static_cast<double>(seafloor.vertices),
               arguments.file.string());
  if (arguments.json) {
    const nlohmann::ordered_json json = {
        {"file", arguments.file.string()},
        {"bytes", bytes},
        {"vertices", seafloor.vertices},
        {"faces", seafloor.faces},
        {"base_vertices", seafloor.progressive->roots.size()},
        {"repairs", seafloor.repairs},
        {"warnings", seafloor.warnings},
        {"times_s", {{"seafloor", seafloor_s}, {"analysis", analysis_s}, {"file", file_s}}},
        {"threads", threads},
    };
    print_object(json);
  }
}

}  // namespace

void add_analyse(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App& command = *app.add_subcommand(
      "analyse",
      "Write a scene's seafloor, or a mesh (PLY, OBJ, STL, OFF), as a progressive mesh for the key "
      "seafloor.progressive (run does this analysis itself when needed and keeps the result in its "
      "cache)");
  arguments->scene.add_to(command);
  command.add_option("-o,--output", arguments->file, "The file to write")
      ->type_name("FILE")
      ->required();
  add_threads(command, arguments->threads);
  add_memory(command, arguments->memory);
  command.add_flag("--json", arguments->json, "Print counts, size and times on stdout");
  command.add_flag("--quiet", arguments->quiet,
                   "No progress and no summary; warnings and errors remain");
  command.callback([&action, arguments] { action = [arguments] { analyse_scene(*arguments); }; });
}

}  // namespace ensonify::engine::app
