#include <algorithm>
#include <memory>
#include <mutex>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/clock.h>
#include <ensonify/engine/base/lower_case.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/run/files_read.h>
#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/seafloor/analysis.h>
#include <ensonify/engine/seafloor/seafloor_in_tiles.h>
#include <ensonify/engine/simulator/prepare.h>
#include <ensonify/engine/simulator/seafloor_cache.h>
#include <ensonify/engine/trace/face_source.h>
#include <ensonify/refine/height_tiles.h>
#include <ensonify/refine/mesh_clusters.h>
#include <ensonify/refine/parallel_for.h>
#include <ensonify/refine/read_file.h>
#include <ensonify/refine/tile_collapse.h>

#include "app.h"
#include "progress.h"

namespace ensonify::engine::app {
namespace {

namespace fs = std::filesystem;

struct AnalyseArguments {
  SceneArguments scene;
  fs::path file, cache;
  int threads = 0;
  MemoryLimit memory;
  bool json = false, quiet = false;
};

/// Reads the scene. If the input is a mesh file, returns a scene whose seafloor is this mesh.
Scene read_input(const SceneArguments& input) {
  constexpr std::array meshes{".ply", ".obj", ".stl", ".off"};
  if (std::ranges::count(meshes, lower_case(input.file.extension().string())) == 0)
    return input.read();
  refine::require_file<UsageError>(input.file);
  const fs::path file = fs::canonical(input.file);  // the user may name a link to a mesh elsewhere
  return parse_scene(fmt::format("version = 1\n[seafloor]\nkind = \"mesh\"\nmesh = {}\n",
                                 toml_string(file.filename().string())),
                     input.file.string(), input.overrides,
                     {.scene_folder = file.parent_path(), .data_folder = input.data_folder});
}

/// The number of tiles or clusters, how many existed before, and the time that the others took.
struct Made {
  std::size_t all = 0, before = 0;
  double seconds = 0.0;
};

/// Makes all tiles of a bed.
Made make_all(refine::HeightTiles& tiles, int threads, Progress& progress) {
  const Clock::time_point start = Clock::now();
  const std::size_t before = tiles.tiles_made();
  // The last chunk first, in the north-east: the borders of each chunk's neighbours are then made.
  std::mutex reporting;
  refine::parallel_for(tiles.chunks(), threads, [&](std::size_t item, int) {
    stop_on_signal("stopped on request; the same command continues");
    tiles.require_chunk(tiles.chunks() - 1 - item);
    const std::lock_guard lock(reporting);
    progress.report("tiles", tiles.tiles_made(), tiles.tiles());
  });
  return {tiles.tiles(), before, seconds_since(start)};
}

/// Analyses all clusters of a bed whose tiles are made.
Made analyse_all(refine::MeshClusters& clusters, int threads, Progress& progress) {
  const Clock::time_point start = Clock::now();
  std::mutex reporting;
  std::size_t done = 0, with_faces = 0;
  refine::parallel_for(clusters.count(), threads, [&](std::size_t cluster, int) {
    stop_on_signal("stopped on request; the same command continues");
    const bool has_faces = clusters.has_faces(cluster);
    if (has_faces) clusters.get(cluster);
    const std::lock_guard lock(reporting);
    with_faces += has_faces;
    progress.report("analysis", ++done, clusters.count());
  });
  return {with_faces, with_faces - clusters.analysed(), seconds_since(start)};
}

/// For a bed that is made in tiles: makes all tiles and, if the surface of runs is `refined`,
/// analyses all clusters. After a stop or a kill, the same command continues.
void make_tiles(const AnalyseArguments& arguments, const Scene& scene, int threads) {
  if (!arguments.file.empty())
    throw UsageError(
        "this bed is made in tiles, which stay in the cache: leave --output out, and use --cache "
        "for another folder");
  std::optional<Progress> progress(std::in_place, arguments.quiet);
  const auto prepared = prepare_seafloor(
      scene, {.cache = arguments.cache, .threads = threads, .memory = arguments.memory});
  if (prepared->origin.cache_file.empty())
    throw UsageError(prepared->warnings.empty() ? "there is no cache to keep the tiles in; name "
                                                  "one with --cache"
                                                : prepared->warnings.front());
  refine::HeightTiles& tiles = *prepared->seafloor.grid->tiles_in_file();
  const Made of_tiles = make_all(tiles, threads, *progress);
  const Made of_clusters =
      prepared->clusters ? analyse_all(*prepared->clusters, threads, *progress) : Made();
  progress.reset();
  print_warnings(prepared->warnings);
  if (!arguments.quiet) {
    print_note(
        "{} points, {} faces: {} tiles, {} of them were there, {:.2f} s on {} thread{}; "
        "{:.2f} GB\n{}\n",
        prepared->seafloor.vertices, prepared->seafloor.faces, of_tiles.all, of_tiles.before,
        of_tiles.seconds, threads, threads == 1 ? "" : "s",
        1e-9 * static_cast<double>(tiles.file_bytes()), prepared->origin.cache_file.string());
    if (prepared->clusters)
      print_note("{} clusters, {} of them were there, {:.2f} s\n", of_clusters.all,
                 of_clusters.before, of_clusters.seconds);
  }
  if (!arguments.json) return;
  nlohmann::ordered_json json = {{"file", prepared->origin.cache_file.string()},
                                 {"bytes", tiles.file_bytes()},
                                 {"vertices", prepared->seafloor.vertices},
                                 {"faces", prepared->seafloor.faces},
                                 {"tiles", of_tiles.all},
                                 {"tiles_before", of_tiles.before},
                                 {"warnings", prepared->warnings},
                                 {"times_s", {{"tiles", of_tiles.seconds}}},
                                 {"threads", threads}};
  if (prepared->clusters) {
    json["clusters"] = of_clusters.all;
    json["clusters_before"] = of_clusters.before;
    json["times_s"]["clusters"] = of_clusters.seconds;
  }
  print_object(json);
}

void analyse_scene(const AnalyseArguments& arguments) {
  const Scene scene = read_input(arguments.scene);
  if (scene.seafloor.kind == SeafloorKind::progressive)
    throw UsageError(
        fmt::format("{}: its seafloor is already analysed", arguments.scene.file.string()));
  const int threads = refine::thread_count(arguments.threads);
  const SignalWatch signals;
  if (needs_tiles(scene.seafloor)) return make_tiles(arguments, scene, threads);
  if (arguments.file.empty()) throw UsageError("--output is missing: the file to write");
  require_not_read(arguments.file, arguments.scene.files_read(scene));
  std::optional<Progress> progress(std::in_place, arguments.quiet);
  const auto stop_if_asked = [] { stop_on_signal("stopped on request; nothing was written"); };
  const auto report = [&](std::string_view stage) {
    stop_if_asked();
    progress->report(stage, 0, 1);
  };

  report("seafloor");
  Clock::time_point start = Clock::now();
  Seafloor seafloor = seafloor_of(scene, {arguments.memory, refine::tile_collapse_bytes_per_face},
                                  BedForm::mesh, {threads, stop_if_asked});
  const double seafloor_s = seconds_since(start);
  report("analysis");
  start = Clock::now();
  with_memory_for("the analysis of the seafloor",
                  [&] { analyse(seafloor, threads, stop_if_asked); });
  const double analysis_s = seconds_since(start);
  report("file");
  start = Clock::now();
  save_analysed(seafloor, seafloor_key(scene), arguments.file);
  const double file_s = seconds_since(start);
  progress.reset();

  print_warnings(seafloor.warnings);
  const std::uintmax_t bytes = fs::file_size(arguments.file);
  if (!arguments.quiet)
    print_note(
        "{} vertices, {} faces: seafloor {:.2f} s, analysis {:.2f} s on {} thread{}, file "
        "{:.2f} s; {:.1f} bytes per vertex\n{}\n",
        seafloor.vertices, seafloor.faces, seafloor_s, analysis_s, threads, threads == 1 ? "" : "s",
        file_s, static_cast<double>(bytes) / static_cast<double>(seafloor.vertices),
        arguments.file.string());
  if (arguments.json)
    print_object({
        {"file", arguments.file.string()},
        {"bytes", bytes},
        {"vertices", seafloor.vertices},
        {"faces", seafloor.faces},
        {"base_vertices", seafloor.progressive->roots.size()},
        {"repairs", seafloor.repairs},
        {"warnings", seafloor.warnings},
        {"times_s", {{"seafloor", seafloor_s}, {"analysis", analysis_s}, {"file", file_s}}},
        {"threads", threads},
    });
}

}  // namespace

void add_analyse(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<AnalyseArguments>();
  CLI::App& command = *app.add_subcommand(
      "analyse",
      "Write a scene's seafloor, or a mesh (PLY, OBJ, STL, OFF), as a progressive mesh. The key "
      "seafloor.progressive of a scene reads it. A run does this analysis itself if it needs one, "
      "and keeps the result in its cache. For a bed that is too large to be made at once, this "
      "command makes all tiles, in the cache; with -D run.surface=refined it also makes the "
      "progressive meshes of all clusters");
  arguments->scene.add_to(command);
  add_output(command, arguments->file, "FILE", "The file to write; not for a bed in tiles");
  add_cache(command, arguments->cache);
  add_threads(command, arguments->threads);
  add_memory(command, arguments->memory);
  command.add_flag("--json", arguments->json, "Print counts, size and times on stdout");
  add_quiet(command, arguments->quiet);
  command.callback([&action, arguments] { action = [arguments] { analyse_scene(*arguments); }; });
}

}  // namespace ensonify::engine::app
