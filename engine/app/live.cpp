#include <ensonify/engine/live/server.h>
#include <ensonify/engine/live/session.h>
#include <ensonify/engine/run.h>

#include <chrono>
#include <memory>
#include <optional>
#include <thread>

#include <fmt/format.h>

#include "app.h"
#include "progress.h"

namespace ensonify::engine::app {
namespace {

struct LiveArguments {
  SceneArguments scene;
  ServerOptions server{.port = 8347};
  std::optional<double> pings_per_s;
  std::filesystem::path cache;
  MemoryLimit memory;
  bool hold = false, quiet = false;
};

void show(const LiveArguments& arguments) {
  using namespace std::chrono_literals;
  if (!has_live_server())
    throw std::runtime_error(
        "this build has no live view: install cpp-httplib (libcpp-httplib-dev) and build again");
  if (!arguments.server.remote && !is_loopback(arguments.server.bind))
    throw UsageError(
        fmt::format("--bind {}: other machines could reach this address, watch and change the "
                    "scene; use 127.0.0.1, or allow it with --remote",
                    arguments.server.bind));
  const SignalWatch signals;
  std::optional<LiveSession> session;
  {
    Progress progress(arguments.quiet);
    session.emplace(LiveOptions{.scene = arguments.scene.file,
                                .overrides = arguments.scene.overrides,
                                .data_folder = arguments.scene.data_folder,
                                .pings_per_s = arguments.pings_per_s,
                                .hold = arguments.hold,
                                .cache = arguments.cache,
                                .memory = arguments.memory,
                                .progress = [&](std::string_view stage) {
                                  stop_on_signal();
                                  progress.report(stage, 0, 1);
                                }});
  }
  print_warnings(session->extrapolation().appended_to(session->warnings()));
  const LiveServer server(*session, arguments.server);
  print(server.address() + "\n");
  if (!arguments.quiet)
    print_note("open this address in a browser on this machine; Ctrl-C ends the program\n");
  session->start();
  while (SignalWatch::caught() == 0 && !session->fault()) std::this_thread::sleep_for(50ms);
  session->stop();
  if (const std::exception_ptr fault = session->fault()) std::rethrow_exception(fault);
  stop_on_signal();
}

}  // namespace

void add_live(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<LiveArguments>();
  CLI::App& command = *app.add_subcommand(
      "live", "Watch a scene in a browser as it pings: its image, its mesh, its truth");
  arguments->scene.add_to(command);
  add_value(command, "--port", arguments->server.port, "P",
            "The page's port (default: 8347; 0: any free one)")
      ->check(CLI::Range(0, 65535));
  add_value(command, "--bind", arguments->server.bind, "ADDR",
            "The address to listen at (default: 127.0.0.1, this machine only)");
  command.add_flag("--remote", arguments->server.remote,
                   "Allow a --bind address that other machines can reach: their users can watch "
                   "and change the scene");
  add_value(command, "--pings-per-s", arguments->pings_per_s, "N",
            "Pings per second (default: the scene's; 0: as fast as possible)")
      ->check(number(0.0, 10000.0));
  command.add_flag("--hold", arguments->hold, "Do not ping until a page starts it");
  add_cache(command, arguments->cache);
  add_memory(command, arguments->memory);
  add_quiet(command, arguments->quiet, "No progress");
  command.callback([&action, arguments] { action = [arguments] { show(*arguments); }; });
}

}  // namespace ensonify::engine::app
