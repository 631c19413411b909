#pragma once

// What the subcommands share. Each has a file with one function, which adds it to the command line.

#include <atomic>
#include <exception>
#include <filesystem>
#include <functional>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json_fwd.hpp>

#include <ensonify/engine/base/clock.h>
#include <ensonify/engine/base/memory.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/refine/printable.h>

namespace ensonify::engine::app {

/// The user's input is wrong: exit code 2.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Some samples failed, and the others are finished: exit code 3.
struct SomeFailed : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A signal stopped the work, and the same command resumes it: exit code 75.
struct Interrupted : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The program that reads stdout has closed it: the exit code of SIGPIPE, without a message.
struct ReaderGone : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The work of a subcommand, called after the command line has been read.
using Action = std::function<void()>;

/// Adds a subcommand to the command line, which sets `action` if the user gives this subcommand.
using AddCommand = void(CLI::App& app, Action& action);
AddCommand add_run, add_stream, add_live, add_generate, add_preview, add_merge, add_mosaic,
    add_analyse, add_check, add_seafloor, add_view, add_trace, add_mesh_info, add_compare,
    add_imitate, add_recording_info, add_dump_default, add_schema, add_intersectors, add_water,
    add_ray, add_backscatter, add_sediments, add_presets;

/// The scene that the command line gives: SCENE, -D and --data.
struct SceneArguments {
  std::filesystem::path file;
  std::vector<std::string> overrides;
  std::filesystem::path data_folder;

  void add_to(CLI::App& command);
  Scene read() const;
  /// The scene's file, followed by what engine::files_read() returns.
  std::vector<std::filesystem::path> files_read(const Scene& scene) const;
};

/// -D: overrides of a scene's or a recipe's keys.
void add_overrides(CLI::App& command, std::vector<std::string>& overrides);
/// --data: the folder in which paths data:PATH of a scene or a recipe begin.
void add_data(CLI::App& command, std::filesystem::path& folder);
/// --cache: the folder for analysed seafloors.
void add_cache(CLI::App& command, std::filesystem::path& cache);
/// --memory: the memory limit of a scene. Without the option: the available memory.
void add_memory(CLI::App& command, MemoryLimit& memory);
/// --threads: the number of threads. Without the option: 0.
void add_threads(CLI::App& command, int& threads);
/// --quiet: no progress and no summary. `silenced` begins the help text.
void add_quiet(CLI::App& command, bool& quiet,
               std::string_view silenced = "No progress and no summary");

/// Adds an option with a value; `type` is the placeholder of the value in the help.
template <class Value>
CLI::Option* add_value(CLI::App& command, const std::string& name, Value& value,
                       const std::string& type, const std::string& help) {
  return command.add_option(name, value, help)->type_name(type);
}

/// -o, --output: the path of what the command writes. `type` is its placeholder in the help.
CLI::Option* add_output(CLI::App& command, std::filesystem::path& path, const std::string& type,
                        const std::string& help);

/// The check of an option that takes a path. It refuses an empty path, which would mean the current
/// folder or the default.
CLI::Validator a_path();
/// The check of an option that takes a number: from `low` to `high`, or any finite number. CLI11's
/// own check accepts NaN. Without a check, CLI11 reads an empty text as 0.
CLI::Validator number(double low = std::numeric_limits<double>::lowest(),
                      double high = std::numeric_limits<double>::max());

/// The check of an option that takes one of these words.
CLI::Validator one_of(std::vector<std::string> words);

/// Reads the value I/N of an option; I counts from 0. Throws UsageError.
Shard parse_shard(std::string_view option, const std::string& text);

/// Writes data to stdout; if that is a terminal, as printable text. Throws Stopped if a signal ends
/// the writing, ReaderGone, and std::runtime_error if the writing fails in another way.
void print(std::string_view text);
/// Writes the object of --json to stdout. Throws as print().
void print_object(const nlohmann::ordered_json& json);
/// Writes a text to stderr without changes. Write errors are ignored: a full disk under a log, or a
/// reader that has ended, must not end the work. After a signal nothing is written to a full pipe.
void write_note(std::string_view text);

/// A text as printable text; any other value unchanged.
template <class Value>
auto printable_value(const Value& value) {
  if constexpr (std::is_convertible_v<const Value&, std::string_view>)
    return refine::printable(value);
  else
    return value;
}
/// Writes a message to stderr. All messages go this way, because their texts may come from outside:
/// they become printable.
template <class... Values>
void print_note(fmt::format_string<const Values&...> format, const Values&... values) {
  const auto formatted = [&](const auto&... shown) {
    return fmt::vformat(format, fmt::make_format_args(shown...));
  };
  write_note(formatted(printable_value(values)...));
}

/// Whether a descriptor can be written at once, without waiting for its reader.
bool can_write_now(int descriptor);

void print_warning(std::string_view warning);
/// Writes warnings to stderr, one per line.
void print_warnings(std::span<const std::string> warnings);

/// The number of columns of the terminal of a descriptor; 80 if it is not a terminal.
std::size_t terminal_columns(int descriptor);

/// While it exists, SIGINT and SIGTERM are recorded and do not end the program. The same holds for
/// SIGHUP, SIGXCPU, SIGUSR1 and SIGUSR2, unless the caller made the program ignore them. A second
/// signal more than a second later ends the program, unless it is SIGXCPU.
class SignalWatch {
 public:
  /// A signal interrupts a read or write that waits only if `interrupts`. Throws std::system_error
  /// if the process has no descriptor left.
  explicit SignalWatch(bool interrupts = false);
  ~SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;
  static int caught() { return caught_; }  ///< the signal's number; 0: none yet
  /// Waits until a descriptor can be read. Returns false if a signal comes first, or came before.
  static bool wait_for_input(int descriptor);
  /// Waits until a descriptor can be written. Returns false if it cannot after a signal.
  static bool wait_for_output(int descriptor);

 private:
  static std::atomic<int> caught_;  // also read by other threads; lock-free, as handlers require
  static std::atomic<Clock::time_point> caught_at_;
  static_assert(std::atomic<int>::is_always_lock_free &&
                std::atomic<Clock::time_point>::is_always_lock_free);
  static int wakes_;  // a descriptor that can be read after a signal was caught
};

/// Throws Stopped with this message after a signal.
void stop_on_signal(const char* message = "stopped on request");

/// Whether an exception is of one of these classes, or of a class derived from one.
template <class... Errors>
bool is_one_of(const std::exception& error) {
  return (dynamic_cast<const Errors*>(&error) || ...);
}

}  // namespace ensonify::engine::app
