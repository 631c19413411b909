#include <csignal>
#include <new>

#include <fmt/format.h>

#include <ensonify/engine/run.h>
#include <ensonify/refine/triangle_mesh.h>

#include "app.h"

namespace app = ensonify::engine::app;

namespace {

constexpr int run_failed = 1;
constexpr int wrong_input = 2;  // usage, scene, or a file that the user gave
constexpr int some_failed = 3;
constexpr int interrupted = 75;  // and resumable
constexpr int by_signal = 128;

int failed(int code, std::string_view message) {
  fmt::print(stderr, "ensonify: {}\n", message);
  return code;
}

int perform(const app::Action& action) {
  try {
    action();
    return 0;
  } catch (const ensonify::engine::Stopped& stopped) {
    return failed(by_signal + app::SignalWatch::caught(), stopped.what());
  } catch (const app::Interrupted& error) {
    return failed(interrupted, error.what());
  } catch (const app::SomeFailed& error) {
    return failed(some_failed, error.what());
  } catch (const app::UsageError& error) {
    return failed(wrong_input, error.what());
  } catch (const ensonify::engine::SceneError& error) {
    return failed(wrong_input, error.what());
  } catch (const ensonify::refine::MeshError& error) {
    return failed(wrong_input, error.what());
  } catch (const std::invalid_argument& error) {
    return failed(wrong_input, error.what());
  } catch (const std::bad_alloc&) {
    return failed(run_failed, "out of memory");
  } catch (const std::exception& error) {
    return failed(run_failed, error.what());
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGXFSZ,
              SIG_IGN);  // a file that may not grow is an error like others, with its message
  CLI::App program("ensonify: sidescan sonar, simulated by tracing rays", "ensonify");
  program.require_subcommand(0, 1);
  program.footer(
      "Data goes to stdout, everything else to stderr. Exit codes: 0 done, 1 the run failed, 2 "
      "usage, "
      "scene or input file, 3 some samples failed, 75 interrupted and resumable, 128+n a signal.");
  app::Action action;
  app::add_run(program, action);
  app::add_stream(program, action);
  app::add_live(program, action);
  app::add_generate(program, action);
  app::add_preview(program, action);
  app::add_merge(program, action);
  app::add_analyse(program, action);
  app::add_check(program, action);
  app::add_seafloor(program, action);
  app::add_view(program, action);
  app::add_trace(program, action);
  app::add_mesh_info(program, action);
  app::add_dump_default(program, action);
  app::add_schema(program, action);
  app::add_intersectors(program, action);
  app::add_water(program, action);
  app::add_ray(program, action);
  app::add_backscatter(program, action);
  app::add_sediments(program, action);
  app::add_presets(program, action);
  try {
    program.parse(argc, argv);
  } catch (const CLI::Success& help) {
    return program.exit(help);
  } catch (const CLI::ParseError& error) {
    return failed(wrong_input, fmt::format("{} (see ensonify --help)", error.what()));
  }
  if (!action) return failed(wrong_input, "a subcommand is required (see ensonify --help)");
  return perform(action);
}
