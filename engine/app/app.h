#pragma once

// What the subcommands share. Each has a file with one function that adds it to the command line.

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json_fwd.hpp>

#include <ensonify/engine/memory.h>
#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine::app {

/// Something is wrong with what the user gave: exit code 2.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Some samples failed, the others are there: exit code 3.
struct SomeFailed : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A signal came, and the same command goes on from here: exit code 75.
struct Interrupted : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What a subcommand does, once the command line has been read.
using Action = std::function<void()>;

void add_run(CLI::App& app, Action& action);
void add_stream(CLI::App& app, Action& action);
void add_live(CLI::App& app, Action& action);
void add_generate(CLI::App& app, Action& action);
void add_preview(CLI::App& app, Action& action);
void add_merge(CLI::App& app, Action& action);
void add_analyse(CLI::App& app, Action& action);
void add_check(CLI::App& app, Action& action);
void add_seafloor(CLI::App& app, Action& action);
void add_view(CLI::App& app, Action& action);
void add_trace(CLI::App& app, Action& action);
void add_mesh_info(CLI::App& app, Action& action);
void add_dump_default(CLI::App& app, Action& action);
void add_schema(CLI::App& app, Action& action);
void add_intersectors(CLI::App& app, Action& action);
void add_water(CLI::App& app, Action& action);
void add_ray(CLI::App& app, Action& action);
void add_backscatter(CLI::App& app, Action& action);
void add_sediments(CLI::App& app, Action& action);
void add_presets(CLI::App& app, Action& action);

/// The scene on the command line: SCENE, -D and --data.
struct SceneArguments {
  std::filesystem::path file;
  std::vector<std::string> overrides;
  std::filesystem::path data_folder;

  void add_to(CLI::App& command);
  Scene read() const;
};

/// --data: the folder of a scene's or a recipe's data:path.
void add_data(CLI::App& command, std::filesystem::path& folder);
/// --cache: the folder for analysed seafloors.
void add_cache(CLI::App& command, std::filesystem::path& cache);
/// --memory: how much memory a scene may take; what is available, unless it is given.
void add_memory(CLI::App& command, MemoryLimit& memory);
/// --threads; 0, unless it is given.
void add_threads(CLI::App& command, int& threads);

/// Data goes to stdout. Throws std::runtime_error if it does not arrive.
void print(std::string_view text);
void print_object(const nlohmann::ordered_json& json);  ///< the same, what --json promises
void print_warnings(std::span<const std::string> warnings);

/// Notes the signals that ask a program to end (SIGINT, SIGTERM) while it lives.
class SignalWatch {
 public:
  /// A read or write that waits goes on after a signal, unless it `interrupts`.
  explicit SignalWatch(bool interrupts = false);
  ~SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;
  static int caught() { return caught_; }  ///< the signal's number; 0: none so far

 private:
  static volatile std::sig_atomic_t caught_;
};

}  // namespace ensonify::engine::app
