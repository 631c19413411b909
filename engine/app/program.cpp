#include <ensonify/engine/app/program.h>

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/untrusted.h>
#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/recording/recording_reader.h>
#include <ensonify/engine/run.h>
#include <ensonify/refine/triangle_mesh.h>
#include <ensonify/scatter/nearest_names.h>

#include "app.h"

namespace app = ensonify::engine::app;

namespace {

constexpr int run_failed = 1;
constexpr int wrong_input = 2;  // wrong usage, scene or input file
constexpr int some_failed = 3;
constexpr int interrupted = 75;  // by a signal; the same command resumes the work
constexpr int by_signal = 128;

int failed(int code, std::string_view message) {
  app::print_note("ensonify: {}\n", message);
  return code;
}

int out_of_memory() {
  return failed(run_failed,
                "out of memory; use larger cells, a smaller area, fewer pings or fewer threads");
}

/// The standard library calls this if the memory runs out in a library's function that may not
/// throw: in constructors of nlohmann::json, and in the standard library's directory iterators
/// (there without an exception). Temporary files stay; the same command, if it is run again,
/// removes them. Other faults end the program as they do without this function.
std::terminate_handler end_by_fault = nullptr;
[[noreturn]] void end_without_memory() {
  try {
    if (const std::exception_ptr thrown = std::current_exception()) std::rethrow_exception(thrown);
  } catch (const std::bad_alloc&) {
  } catch (...) {
    end_by_fault();
  }
  std::_Exit(out_of_memory());
}

/// Some libraries end the process themselves if the memory runs out: FFTW by abort(), libarchive by
/// an invalid write. If a sanitizer has set its own handlers, these stay.
extern "C" void end_by_library(int /*signal*/) {
  constexpr std::string_view message =
      "ensonify: stopped by a fault of ensonify or one of its libraries. If a line above names "
      "memory, use larger cells, a smaller area, fewer pings or fewer threads; else please report "
      "it. Run the same command again: it removes what this one left behind\n";
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, message.data(), message.size());
  ::_exit(run_failed);
}
void catch_signals_of_libraries() {
  for (const int number : {SIGABRT, SIGSEGV}) {
    const auto before = std::signal(number, end_by_library);
    if (before != SIG_DFL) std::signal(number, before);
  }
}

/// Opens those of stdin, stdout and stderr that the caller has closed, so that no other file gets
/// their descriptors. A write to such a stdout still fails.
void open_closed_streams() {
  for (int descriptor = STDIN_FILENO; descriptor <= STDERR_FILENO; ++descriptor)
    if (::fcntl(descriptor, F_GETFD) < 0)  // open() takes the lowest free number
      ::open("/dev/null", descriptor == STDOUT_FILENO ? O_RDONLY : O_RDWR);
}

int perform(const app::Action& action) {
  try {
    action();
    return 0;
  } catch (const ensonify::engine::StoppedBetweenParts& stopped) {
    return failed(interrupted, stopped.what());
  } catch (const ensonify::engine::Stopped& stopped) {
    return failed(by_signal + app::SignalWatch::caught(), stopped.what());
  } catch (const app::ReaderGone&) {
    return by_signal + SIGPIPE;
  } catch (const app::Interrupted& error) {
    return failed(interrupted, error.what());
  } catch (const app::SomeFailed& error) {
    return failed(some_failed, error.what());
  } catch (const std::bad_alloc&) {
    return out_of_memory();
  } catch (const std::filesystem::filesystem_error& error) {
    return failed(run_failed, fmt::format("{}: {}; correct the path", error.path1().string(),
                                          error.code().message()));
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::resource_unavailable_try_again)
      return failed(run_failed,
                    "the system allows no more threads; use fewer --threads, or raise `ulimit -u`");
    return failed(run_failed, error.what());
  } catch (const std::exception& error) {
    const bool is_input = app::is_one_of<app::UsageError, ensonify::engine::SceneError,
                                         ensonify::engine::RecordingError,
                                         ensonify::refine::MeshError, std::invalid_argument>(error);
    return failed(is_input ? wrong_input : run_failed, error.what());
  }
}

/// The versions of the program and of the libraries that can change a result, one per line.
std::string versions() {
  std::string text = fmt::format("ensonify {}", ensonify::engine::program_version());
  const auto libraries =
      ensonify::engine::json_of<nlohmann::ordered_json>(ensonify::engine::library_versions());
  for (const auto& [name, version] : libraries.items())
    text += fmt::format("\n{} {}", name, version.get<std::string>());
  return text;
}

/// CLI11's help with long lines broken between words.
class BrokenLines final : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* command, std::string name,
                        CLI::AppFormatMode mode) const override {
    const std::size_t columns = app::terminal_columns(STDOUT_FILENO);
    std::istringstream help(CLI::Formatter::make_help(command, std::move(name), mode));
    std::string broken;
    for (std::string line; std::getline(help, line);) {
      // The lines of an option or a subcommand continue below its description.
      const std::size_t indent = line.starts_with("  ") ? get_column_width() : 0;
      while (line.size() > columns) {
        std::size_t end = line.rfind(' ', columns);
        if (end == line.npos || end <= indent) end = line.rfind(',', columns - 1) + 1;  // a list
        if (end <= indent) break;
        broken += line.substr(0, line.find_last_not_of(' ', end - 1) + 1) + "\n";
        line = std::string(indent, ' ') + line.substr(end + (line[end] == ' '));
      }
      broken += line + "\n";
    }
    return broken;
  }

  /// A row of the list of subcommands: the first sentence of the description.
  std::string make_subcommand(const CLI::App* command) const override {
    const std::string text = command->get_description();
    std::ostringstream row;
    CLI::detail::format_help(row, command->get_display_name(true), text.substr(0, text.find(". ")),
                             get_column_width());
    return row.str();
  }
};

/// Why the command line is refused. Unexpected arguments are listed in the order in which they were
/// given; CLI11 reverses them.
std::string fault_of(const CLI::App& program, const CLI::ParseError& error) {
  const std::vector<CLI::App*> parsed = program.get_subcommands();
  const std::string help = fmt::format("(see ensonify {}--help)",
                                       parsed.empty() ? "" : parsed.front()->get_name() + " ");
  if (!dynamic_cast<const CLI::ExtrasError*>(&error))
    return fmt::format("{} {}", error.what(), help);
  const std::vector<std::string> extra = program.remaining(true);
  std::vector<std::string> known;
  if (parsed.empty())
    for (const CLI::App* command : program.get_subcommands({}))
      known.push_back(command->get_name());
  else
    for (const CLI::Option* option : parsed.front()->get_options())
      for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
  std::string hint = ensonify::scatter::suggestion(extra.front(), known);
  if (parsed.empty() && extra.front().ends_with(".toml"))
    hint = fmt::format("; did you mean 'run {}'?", extra.front());
  else if (std::ranges::count(known, extra.front()) > 0)
    hint = "; give it after the subcommand";
  return fmt::format("not expected: {}{} {}", fmt::join(extra, " "), hint, help);
}

int run_command_line(int argc, char** argv) {
  CLI::App program("ensonify: sidescan sonar simulated by ray tracing", "ensonify");
  program.formatter(std::make_shared<BrokenLines>());
  program.set_version_flag("--version", versions);
  program.require_subcommand(0, 1);
  program.footer(
      "Data goes to stdout, everything else to stderr. Exit codes: 0 success; 1 the run failed; "
      "2 wrong usage, scene or input file; 3 some samples failed; 75 interrupted, can be resumed; "
      "128+n ended by signal n.");
  app::Action action;
  for (app::AddCommand* const add :
       {app::add_run,          app::add_stream,      app::add_live,         app::add_generate,
        app::add_preview,      app::add_merge,       app::add_mosaic,       app::add_analyse,
        app::add_check,        app::add_seafloor,    app::add_view,         app::add_trace,
        app::add_mesh_info,    app::add_compare,     app::add_imitate,      app::add_recording_info,
        app::add_dump_default, app::add_schema,      app::add_intersectors, app::add_water,
        app::add_ray,          app::add_backscatter, app::add_sediments,    app::add_presets})
    add(program, action);
  program.footer(
      "`ensonify COMMAND --help` describes a command and its options. Begin with `ensonify run "
      "SCENE`.\n" +
      program.get_footer());
  // `ensonify help` and `ensonify help run` also print the help, as in other programs.
  std::vector<std::string> words(argv + std::min(1, argc), argv + argc);
  if (!words.empty() && words.front() == "help") {
    words.erase(words.begin());
    if (words.empty() ||
        std::ranges::count(program.get_subcommands({}), words.front(), &CLI::App::get_name) > 0)
      words.emplace_back("--help");
  }
  std::ranges::reverse(words);  // CLI11 takes the last word first
  try {
    program.parse(std::move(words));
  } catch (const CLI::Success& help) {
    std::ostringstream text;
    program.exit(help, text);
    return perform([&] { app::print(text.str()); });
  } catch (const CLI::ParseError& error) {
    return failed(wrong_input, fault_of(program, error));
  }
  if (!action) return failed(wrong_input, "a subcommand is required (see ensonify --help)");
  return perform(action);
}

}  // namespace

int app::program_main(int argc, char** argv, bool optimised) {
  open_closed_streams();
  // A write beyond the file size limit, or to a pipe without a reader, then fails with an error.
  for (const int number : {SIGXFSZ, SIGPIPE}) std::signal(number, SIG_IGN);
  end_by_fault = std::set_terminate(end_without_memory);
  catch_signals_of_libraries();
  if (!optimised)
    app::print_note(
        "ensonify: warning: this program is compiled without optimisation, so it may be ten times "
        "slower; configure it with -D CMAKE_BUILD_TYPE=Release\n");
  try {
    return run_command_line(argc, argv);
  } catch (const std::bad_alloc&) {
    return out_of_memory();
  }
}
