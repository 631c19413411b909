#include <algorithm>
#include <memory>
#include <mutex>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/clock.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/seafloor/analysis.h>
#include <ensonify/engine/seafloor/seafloor_in_tiles.h>
#include <ensonify/engine/simulator/prepare.h>
#include <ensonify/engine/trace/face_source.h>
#include <ensonify/refine/height_tiles.h>
#include <ensonify/refine/parallel_for.h>
#include <ensonify/refine/tile_collapse.h>

#include "app.h"
#include "progress.h"

namespace ensonify::engine::app {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  SceneArguments scene;
  fs::path file, cache;
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

/// Makes all tiles of a bed that is made in tiles. After a stop or a kill, the same command
/// continues.
void make_tiles(const Arguments& arguments, const Scene& scene, int threads) {
  if (!arguments.file.empty())
    throw UsageError(
        "this bed is made in tiles, which stay in the cache: leave --output out, and take --cache "
        "for another folder");
  std::optional<Progress> progress(std::in_place, arguments.quiet);
  const Clock::time_point start = Clock::now();
  const auto prepared = prepare_seafloor(
      scene, {.cache = arguments.cache, .threads = threads, .memory = arguments.memory});
  if (prepared->cache_file.empty())
    throw UsageError(prepared->warnings.empty() ? "there is no cache to keep the tiles in; name "
                                                  "one with --cache"
                                                : prepared->warnings.front());
  refine::HeightTiles& tiles = *prepared->seafloor.grid->tiles_in_file();
  const std::size_t before = tiles.tiles_made();
  // From the north-east, where each chunk finds the borders of its neighbours made.
  std::mutex reporting;
  refine::parallel_for(tiles.chunks(), threads, [&](std::size_t item, int) {
    if (SignalWatch::caught() != 0) throw Stopped("stopped on request; the same command continues");
    tiles.require_chunk(tiles.chunks() - 1 - item);
    const std::lock_guard lock(reporting);
    progress->report("tiles", tiles.tiles_made(), tiles.tiles());
  });
  progress.reset();
  const double seconds = seconds_since(start);
  print_warnings(prepared->warnings);
  if (!arguments.quiet)
    fmt::print(stderr,
               "{} points, {} faces: {} tiles, {} of them were there, {:.2f} s on {} thread{}; "
               "{:.2f} GB\n{}\n",
               prepared->seafloor.vertices, prepared->seafloor.faces, tiles.tiles(), before,
               seconds, threads, threads == 1 ? "" : "s",
               1e-9 * static_cast<double>(tiles.file_bytes()), prepared->cache_file.string());
  if (arguments.json)
    print_object({{"file", prepared->cache_file.string()},
                  {"bytes", tiles.file_bytes()},
                  {"vertices", prepared->seafloor.vertices},
                  {"faces", prepared->seafloor.faces},
                  {"tiles", tiles.tiles()},
                  {"tiles_before", before},
                  {"warnings", prepared->warnings},
                  {"times_s", {{"tiles", seconds}}},
                  {"threads", threads}});
}

void analyse_scene(const Arguments& arguments) {
  const Scene scene = read_input(arguments.scene);
  if (scene.seafloor.kind == SeafloorKind::progressive)
    throw UsageError(
        fmt::format("{}: its seafloor is already analysed", arguments.scene.file.string()));
  const int threads = refine::thread_count(arguments.threads);
  const SignalWatch signals;
  if (needs_tiles(scene.seafloor)) return make_tiles(arguments, scene, threads);
  if (arguments.file.empty()) throw UsageError("--output is missing: the file to write");
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
      "cache). Of a bed that is too large to be made at once, make all tiles, in the cache");
  arguments->scene.add_to(command);
  command.add_option("-o,--output", arguments->file, "The file to write; not for a bed in tiles")
      ->type_name("FILE");
  add_cache(command, arguments->cache);
  add_threads(command, arguments->threads);
  add_memory(command, arguments->memory);
  command.add_flag("--json", arguments->json, "Print counts, size and times on stdout");
  command.add_flag("--quiet", arguments->quiet,
                   "No progress and no summary; warnings and errors remain");
  command.callback([&action, arguments] { action = [arguments] { analyse_scene(*arguments); }; });
}

}  // namespace ensonify::engine::app
