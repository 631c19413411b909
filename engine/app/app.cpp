#include "app.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <climits>
#include <cmath>
#include <csignal>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/base/number_in.h>
#include <ensonify/engine/run/files_read.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/simulator/prepare.h>
#include <ensonify/refine/printable.h>

namespace ensonify::engine::app {
namespace {

/// SIGHUP reports a closed terminal; nohup makes the program ignore it. Batch systems send the
/// others before they end a job.
constexpr std::array ignorable_signals{SIGHUP, SIGXCPU, SIGUSR1, SIGUSR2};

/// Replaces a size with a unit, such as 800MB or 1.5GiB, by its number of bytes. Returns what is
/// wrong with the text; empty if nothing is.
std::string size_in_bytes(std::string& text) {
  const char* const end = text.data() + text.size();
  double number = 0.0;
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  std::string_view unit(rest, end);
  double factor = 1.0;
  constexpr std::string_view prefixes = "KMGT";
  if (const std::size_t place = prefixes.find(unit.substr(0, 1)); !unit.empty() && place < 4) {
    unit.remove_prefix(1);
    const bool binary = unit.starts_with('i');
    if (binary) unit.remove_prefix(1);
    factor = std::pow(binary ? 1024.0 : 1000.0, static_cast<double>(place + 1));
  }
  if (error != std::errc() || !(number > 0.0 && std::isfinite(number)) ||
      !(unit.empty() || unit == "B"))
    return fmt::format("{} is not a size, expected for example 800MB, 8GB or 8GiB", text);
  if (number * factor < 1000.0)  // the user forgot the unit
    return fmt::format("{} is {} bytes, expected for example 800MB, 8GB or 8GiB", text,
                       number * factor);
  text = fmt::format("{:.0f}", number * factor);
  return "";
}

}  // namespace

void SceneArguments::add_to(CLI::App& command) {
  command.add_option("SCENE", file, "A scene file (`ensonify dump-default run` prints one)")
      ->required();
  add_overrides(command, overrides);
  add_data(command, data_folder);
}

Scene SceneArguments::read() const { return read_scene(file, overrides, data_folder); }

std::vector<std::filesystem::path> SceneArguments::files_read(const Scene& scene) const {
  std::vector<std::filesystem::path> files = engine::files_read(scene);
  files.insert(files.begin(), file);
  return files;
}

void add_overrides(CLI::App& command, std::vector<std::string>& overrides) {
  add_value(command, "-D", overrides, "KEY=VALUE",
            "Change a key, for example -D sonar.sidescan.range_m=50; can be repeated")
      ->allow_extra_args(false);
}

void add_data(CLI::App& command, std::filesystem::path& folder) {
  add_value(command, "--data", folder, "DIR",
            "The folder in which data:PATH of a scene or a recipe lies")
      ->envname("ENSONIFY_DATA");
}

void add_cache(CLI::App& command, std::filesystem::path& cache) {
  cache = default_cache();
  add_value(command, "--cache", cache, "DIR",
            "The folder for analysed seafloors (default: ~/.cache/ensonify)")
      ->envname("ENSONIFY_CACHE");
}

void add_threads(CLI::App& command, int& threads) {
  add_value(command, "--threads", threads, "N", "Number of threads (default: all of the machine's)")
      ->check(CLI::Range(1, 1024));
}

void add_memory(CLI::App& command, MemoryLimit& memory) {
  command
      .add_option_function<double>(
          "--memory", [&memory](double bytes) { memory.bytes = bytes; },
          "The most memory to use, for example 800MB or 8GB (default: the available memory)")
      ->type_name("SIZE")
      ->transform(CLI::Validator(size_in_bytes, ""));
}

void add_quiet(CLI::App& command, bool& quiet, std::string_view silenced) {
  command.add_flag("--quiet", quiet, fmt::format("{}; warnings and errors remain", silenced));
}

CLI::Option* add_output(CLI::App& command, std::filesystem::path& path, const std::string& type,
                        const std::string& help) {
  return add_value(command, "-o,--output", path, type, help)->check(a_path());
}

CLI::Validator a_path() {
  return CLI::Validator(
      [](std::string& text) {
        return text.empty() ? std::string("the path is empty; name one") : std::string();
      },
      "");
}

CLI::Validator number(double low, double high) {
  const bool any = high == std::numeric_limits<double>::max();
  const std::string range = any ? "" : fmt::format(" from {} to {}", low, high);
  return CLI::Validator(
      [=](std::string& text) {
        const std::string_view digits =
            text.starts_with('+') ? std::string_view(text).substr(1) : text;
        const std::optional value = number_in<double>(digits);
        return value && *value >= low && *value <= high
                   ? ""
                   : fmt::format("'{}' is not a number{}", text, range);
      },
      any ? "" : fmt::format("FLOAT in [{:g} - {:g}]", low, high));
}

CLI::Validator one_of(std::vector<std::string> words) {
  const std::string expected = words.size() == 2 ? fmt::format("{} or {}", words[0], words[1])
                                                 : fmt::format("one of {}", fmt::join(words, ", "));
  return CLI::Validator(
      [words = std::move(words), expected](std::string& text) {
        return std::ranges::count(words, text) > 0
                   ? std::string()
                   : fmt::format("'{}', expected {}", text, expected);
      },
      "");
}

Shard parse_shard(std::string_view option, const std::string& text) {
  const std::size_t slash = text.find('/');
  if (slash != std::string::npos) {
    const auto index = number_in<std::size_t>(std::string_view(text).substr(0, slash));
    const auto count = number_in<std::size_t>(std::string_view(text).substr(slash + 1));
    if (index && count && *index < *count) return {*index, *count};
  }
  throw UsageError(
      fmt::format("{0} {1}: expected I/N with I from 0 to N-1, for example {0} 0/4", option, text));
}

void print(std::string_view text) {
  std::string shown;
  if (::isatty(STDOUT_FILENO)) text = shown = refine::printable(text, "\n\t");
  // A pipe that can be written takes this many bytes at once, without waiting for the reader.
  constexpr std::size_t most = PIPE_BUF;
  while (!text.empty()) {
    if (!SignalWatch::wait_for_output(STDOUT_FILENO)) throw Stopped("stopped on request");
    const ssize_t written = ::write(STDOUT_FILENO, text.data(), std::min(most, text.size()));
    if (written > 0)
      text.remove_prefix(static_cast<std::size_t>(written));
    else if (written < 0 && errno == EPIPE)
      throw ReaderGone("stdout: its reader has closed it");
    else if (written == 0 || (errno != EINTR && errno != EAGAIN))
      throw std::runtime_error(
          "stdout: not all of the output could be written; check the disk, or the program that reads "
          "it");
  }
}

bool can_write_now(int descriptor) {
  pollfd wanted{descriptor, POLLOUT, 0};
  return ::poll(&wanted, 1, 0) > 0;
}

void write_note(std::string_view text) {
  if (!SignalWatch::wait_for_output(STDERR_FILENO)) return;
  [[maybe_unused]] const auto written = std::fwrite(text.data(), 1, text.size(), stderr);
}

void print_object(const nlohmann::ordered_json& json) { print(json_text(json, 2) + "\n"); }

void print_warning(std::string_view warning) { print_note("ensonify: warning: {}\n", warning); }
void print_warnings(std::span<const std::string> warnings) {
  for (const std::string& warning : warnings) print_warning(warning);
}

void stop_on_signal(const char* message) {
  if (SignalWatch::caught() != 0) throw Stopped(message);
}

std::size_t terminal_columns(int descriptor) {
  winsize size{};
  if (::ioctl(descriptor, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return 80;
  return size.ws_col;
}

std::atomic<int> SignalWatch::caught_ = 0;
std::atomic<Clock::time_point> SignalWatch::caught_at_;
int SignalWatch::wakes_ = -1;

SignalWatch::SignalWatch(bool interrupts) {
  wakes_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (wakes_ < 0)
    throw std::system_error(errno, std::generic_category(), "cannot watch for signals");
  struct sigaction action {};
  action.sa_handler = [](int number) {
    const int error = errno;
    if (caught_ == 0) {
      caught_at_ = Clock::now();
      caught_ = number;
    } else if (number != SIGXCPU &&  // the system sends it again for each second of processor time
               seconds_since(caught_at_) > 1.0) {  // `timeout` sends each signal twice at once
      std::signal(number, SIG_DFL);
      std::raise(number);
    }
    static_cast<void>(::eventfd_write(wakes_, 1));
    errno = error;
  };
  action.sa_flags = interrupts ? 0 : SA_RESTART;
  for (const int signal : {SIGINT, SIGTERM}) sigaction(signal, &action, nullptr);
  for (const int signal : ignorable_signals)
    if (std::signal(signal, SIG_IGN) != SIG_IGN) sigaction(signal, &action, nullptr);
}

SignalWatch::~SignalWatch() {
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, SIG_DFL);
  for (const int signal : ignorable_signals)
    if (std::signal(signal, SIG_IGN) != SIG_IGN) std::signal(signal, SIG_DFL);
  ::close(std::exchange(wakes_, -1));
}

bool SignalWatch::wait_for_input(int descriptor) {
  // If a signal comes after caught_ was read and before a read begins, only poll() notices it.
  while (caught_ == 0) {
    std::array<pollfd, 2> wanted{{{descriptor, POLLIN, 0}, {wakes_, POLLIN, 0}}};
    if (::poll(wanted.data(), wanted.size(), -1) > 0 && wanted[0].revents != 0)
      return wanted[1].revents == 0;
  }
  return false;
}

bool SignalWatch::wait_for_output(int descriptor) {
  while (!can_write_now(descriptor)) {
    if (caught_ != 0) return false;
    std::array<pollfd, 2> wanted{{{descriptor, POLLOUT, 0}, {wakes_, POLLIN, 0}}};
    ::poll(wanted.data(), wanted.size(), -1);
  }
  return true;
}

}  // namespace ensonify::engine::app
