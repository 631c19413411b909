#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/base/lower_case.h>
#include <ensonify/engine/image/ping_rendering.h>
#include <ensonify/engine/output/png.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/run/files_read.h>
#include <ensonify/engine/seafloor/seafloor_in_tiles.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/internals.h>
#include <ensonify/engine/trace/face_source.h>
#include <ensonify/engine/trace/face_sources/exact_faces.h>
#include <ensonify/refine/active_mesh.h>
#include <ensonify/refine/atomic_file.h>
#include <ensonify/refine/parallel_for.h>

#include "app.h"
#include "progress.h"

namespace ensonify::engine::app {
namespace {

struct ViewArguments {
  SceneArguments scene;
  std::filesystem::path file;
  std::optional<std::size_t> ping;
  std::size_t width_px = 1600;
  std::filesystem::path cache;
  MemoryLimit memory;
  bool quiet = false;
};

void view_scene(const ViewArguments& arguments) {
  if (lower_case(arguments.file.extension().string()) != ".png")
    throw UsageError(
        fmt::format("{}: a view is written as PNG, expected FILE.png", arguments.file.string()));
  Scene scene = arguments.scene.read();
  require_not_read(arguments.file, arguments.scene.files_read(scene));
  require_at_once(scene.seafloor);
  refine::NewFile file(arguments.file);  // fails now, not after the picture is drawn
  // The simulator only makes the seafloor and aims the fans; with these settings it builds no tree.
  scene.run.surface = static_surface;
  scene.run.intersector = "fan_scan";

  const SignalWatch signals;
  Progress progress(arguments.quiet);
  const auto stop_if_asked = [] { stop_on_signal("stopped on request; nothing was written"); };
  const auto report = [&](std::string_view stage, std::size_t done, std::size_t of) {
    stop_if_asked();
    progress.report(stage, done, of);
  };
  Simulator simulator(scene, {.cache = arguments.cache,
                              .progress = [&](std::string_view stage) { report(stage, 0, 1); },
                              .memory = arguments.memory});
  const std::vector<Pose> track = simulator.track();
  const std::size_t ping = arguments.ping.value_or(track.size() / 2);
  if (ping >= track.size())
    throw UsageError(fmt::format("--ping {}: the track has {} pings; expected 0 to {}", ping,
                                 track.size(), track.size() - 1));
  report("progressive mesh", 0, 1);
  const auto progressive =
      make_progressive_mesh(simulator.seafloor().mesh, refine::thread_count(0), stop_if_asked);
  const std::span<const RayFan> fans = SimulatorInternals::aim(simulator, track[ping]);
  std::vector<refine::FanVolume> volumes;
  for (const RayFan& fan : fans) volumes.push_back(fan_volume_of(fan));
  refine::ActiveMesh mesh(*progressive);
  mesh.refine(volumes);

  stop_if_asked();
  const PingRendering view =
      shade({simulator.seafloor(), mesh, fans, track, ping},
            {.width_px = arguments.width_px,
             .height_px = std::max<std::size_t>(1, arguments.width_px * 9 / 16),
             .threads = refine::thread_count(0),
             .progress = [&](auto done, auto of) { report("picture", done, of); }});
  file.write(encode_png(view.picture));
  file.commit();
  print_warnings(simulator.warnings());
}

}  // namespace

void add_view(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<ViewArguments>();
  CLI::App& command = *app.add_subcommand(
      "view",
      "Draw one ping of a scene: the sonar above the seafloor, its fans, and the mesh refined for "
      "them, with exact faces in amber");
  arguments->scene.add_to(command);
  add_output(command, arguments->file, "FILE.png", "The picture")->required();
  add_value(command, "--ping", arguments->ping, "N", "The ping, from 0 (default: the middle one)")
      ->check(CLI::Range(std::size_t{0}, std::size_t{1000000000}));
  add_value(command, "--width-px", arguments->width_px, "N",
            "The picture's width; its height is 9/16 of it (default: 1600)")
      ->check(CLI::Range(16, 16384));
  add_cache(command, arguments->cache);
  add_memory(command, arguments->memory);
  add_quiet(command, arguments->quiet, "No progress");
  command.callback([&action, arguments] { action = [arguments] { view_scene(*arguments); }; });
}

}  // namespace ensonify::engine::app
