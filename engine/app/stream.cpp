#include <ensonify/engine/run.h>
#include <ensonify/engine/session_keys.h>
#include <ensonify/engine/simulator/prepare.h>

#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cmath>
#include <memory>
#include <set>
#include <string>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/base/memory.h>
#include <ensonify/scatter/kind_named.h>

#include "app.h"
#include "progress.h"
#include "stream_request.h"

namespace ensonify::engine::app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// The version of requests and answers, with which a client checks whether it fits.
constexpr int protocol = 1;

struct StreamArguments {
  SceneArguments scene;
  fs::path cache;
  MemoryLimit memory;
  std::vector<std::string> layers = {"intensity"};
  bool json = false, answer_all = false, quiet = false;
};

/// A session: it answers requests, and writes the echo lines of pings.
class PoseSession {
 public:
  explicit PoseSession(const StreamArguments& arguments)
      : arguments_(arguments),
        source_(SessionScene::of_file(arguments.scene.file, arguments.scene.overrides,
                                      arguments.scene.data_folder)),
        scene_(with_session_surface(source_.with())),
        simulator_(make_simulator(scene_, arguments)) {
    std::vector<std::string_view> known_layers;
    BinLayers::for_each([&](std::string_view name, auto) { known_layers.push_back(name); });
    for (std::string& name : arguments_.layers) {
      const auto known = std::ranges::find_if(
          known_layers, [&](std::string_view one) { return scatter::same_name(one, name); });
      if (known == known_layers.end())
        throw UsageError(fmt::format("--layers: there is no layer '{}', expected {}", name,
                                     fmt::join(known_layers, ", ")));
      name = *known;  // answers have the spelling of the layer's name
    }
    report_scene();
    print_warnings(warnings_for_single_pings(scene_));
  }

  /// Answers a request. Throws SceneError, refine::MeshError, MemoryError or std::invalid_argument
  /// for a faulty request; then nothing is changed.
  void answer(const std::string& line) {
    using Kind = StreamRequest::Kind;
    const StreamRequest request = read_stream_request(line);
    switch (request.kind) {
      case Kind::ping: return ping(request.pose);
      case Kind::set: return set(request.keys);
      case Kind::add: return add(request.keys, request.pose);
      case Kind::move:
        simulator_.move(request.instance, request.pose);
        if (arguments_.answer_all) write_json({{"moved", request.instance}});
        return;
      case Kind::remove:
        simulator_.remove(request.instance);
        if (arguments_.answer_all) write_json({{"removed", request.instance}});
        return;
    }
  }

  void answer_error(const std::string& error) { write_json({{"error", error}}); }

 private:
  static Simulator make_simulator(const Scene& scene, const StreamArguments& arguments) {
    Progress progress(arguments.quiet);
    const auto stop_check = [] { stop_on_signal(); };
    return Simulator(scene, {.cache = arguments.cache,
                             .progress =
                                 [&](std::string_view stage) {
                                   stop_check();
                                   progress.report(stage, 0, 1);
                                 },
                             .stop_check = stop_check,
                             .memory = arguments.memory});
  }

  void set(const std::vector<KeyValue>& keys) {
    set_sonars(simulator_, source_, keys);
    report_scene();
  }

  void add(const std::vector<KeyValue>& keys, const Pose& pose) {
    const std::uint32_t number = simulator_.add(
        object_of(keys, "'add'", scene_, source_.paths(), simulator_.next_instance()), pose);
    write_json({{"added", number},
                {"classes", strings(simulator_.classes())},
                {"materials", strings(simulator_.materials())}});
    report_extrapolation();
  }

  void ping(const Pose& pose) {
    std::span<const EchoLine> lines = simulator_.ping(pose);
    report_warnings();
    const double altitude_m = simulator_.altitude_m(pose.position);
    for (const Sonar& sonar : simulator_.sonars()) {
      const std::size_t count = sonar.sectors().size() * static_cast<std::size_t>(sonar.beams);
      for (const EchoLine& line : lines.first(count)) {
        Json header = {{"ping", pings_},
                       {"t_s", pose.t_s},
                       {"sonar", sonar.name},
                       {"side", sonar.sectors()[line.sector].name},
                       {"sector", line.sector},
                       {"beam", line.beam},
                       {"bins", sonar.bins},
                       {"bin_m", sonar.bin_m()},
                       {"first_return", line.first_return},
                       {"altitude_m", std::isnan(altitude_m) ? Json() : Json(altitude_m)}};
        block_.clear();
        for (const std::string& wanted : arguments_.layers)
          BinLayers::for_each([&](std::string_view name, auto layer) {
            if (name != wanted) return;
            if (arguments_.json)
              header[wanted] = line.bins.*layer;
            else
              block_.insert(block_.end(), (line.bins.*layer).begin(), (line.bins.*layer).end());
          });
        if (!arguments_.json) {
          header["layers"] = arguments_.layers;
          header["bytes"] = block_.size() * sizeof(float);
        }
        write_json(header);
        static_assert(std::endian::native == std::endian::little);
        print({reinterpret_cast<const char*>(block_.data()), block_.size() * sizeof(float)});
      }
      lines = lines.subspan(count);
    }
    ++pings_;
  }

  void report_scene() {
    Json sonars = Json::array();
    for (const Sonar& sonar : simulator_.sonars()) {
      Json sides = Json::array();
      for (const Sector& sector : sonar.sectors()) sides.push_back(sector.name);
      sonars.push_back({{"name", sonar.name},
                        {"sides", sides},
                        {"beams", sonar.beams},
                        {"range_m", sonar.range_m},
                        {"bins", sonar.bins},
                        {"bin_m", sonar.bin_m()}});
    }
    write_json({{"protocol", protocol},
                {"sonars", sonars},
                {"classes", strings(simulator_.classes())},
                {"materials", strings(simulator_.materials())}});
    report_warnings();
    report_extrapolation();
  }

  void report_warnings() {
    print_warnings(simulator_.warnings().subspan(warned_));
    warned_ = simulator_.warnings().size();
  }

  /// Prints the warning about extrapolated levels, unless the same text was printed before.
  void report_extrapolation() {
    const auto warning =
        Extrapolation(simulator_.sonars(), simulator_.materials(), scene_.materials).warning();
    if (warning && extrapolations_.insert(*warning).second) print_warning(*warning);
  }

  static std::vector<std::string> strings(std::span<const std::string> all) {
    return {all.begin(), all.end()};
  }

  static void write_json(const Json& json) { print(json_text(json) + "\n"); }

  StreamArguments arguments_;
  SessionScene source_;
  const Scene scene_;  // as it was read, without later changes
  Simulator simulator_;
  std::vector<float> block_;
  std::uint64_t pings_ = 0;
  std::size_t warned_ = 0;
  std::set<std::string> extrapolations_;  // the warnings that were printed
};

/// The lines of stdin, up to its end or up to a signal. A line that is too long for a request is
/// returned at once, without its rest.
class InputLines {
 public:
  bool next(std::string& line) {
    while (true) {
      const std::size_t end = read_.find('\n', searched_);
      const bool ends = end != read_.npos;
      if (ends || leaves_out_ || read_.size() > longest_request) {
        const bool wanted = !std::exchange(leaves_out_, !ends);
        if (wanted) line = read_.substr(0, end);
        read_.erase(0, ends ? end + 1 : end);
        searched_ = 0;
        if (wanted) return SignalWatch::caught() == 0;
        if (ends) continue;
      }
      searched_ = read_.size();
      if (!SignalWatch::wait_for_input(STDIN_FILENO)) return false;
      const ssize_t count = ::read(STDIN_FILENO, buffer_.data(), buffer_.size());
      if (count < 0 && (errno == EINTR || errno == EAGAIN)) continue;
      if (count < 0)
        throw std::system_error(errno, std::generic_category(), "stdin: cannot be read");
      if (count == 0) {
        line = std::exchange(read_, {});  // the last line has no line end
        searched_ = 0;
        return !line.empty();
      }
      read_.append(buffer_.data(), static_cast<std::size_t>(count));
    }
  }

 private:
  std::string read_;          // bytes that were read and not returned yet
  std::size_t searched_ = 0;  // the first bytes of read_, in which there is no line end
  bool leaves_out_ = false;   // whether bytes up to the next line end are skipped
  std::array<char, 65536> buffer_;
};

void stream(const StreamArguments& arguments) {
  const SignalWatch signals(true);
  PoseSession stream(arguments);
  InputLines lines;
  std::string line;
  for (std::size_t number = 1; lines.next(line); ++number) {
    if (line.size() <= longest_request && line.find_first_not_of(" \t\r") == line.npos) continue;
    try {
      stream.answer(line);
    } catch (const std::exception& error) {
      const bool is_input = is_one_of<SceneError, refine::MeshError, std::invalid_argument>(error);
      if (!is_input && !(arguments.answer_all && is_one_of<MemoryError>(error))) throw;
      const std::string message = fmt::format("stdin:{}: {}", number, error.what());
      if (!arguments.answer_all) throw UsageError(message);
      stream.answer_error(message);
    }
  }
  stop_on_signal();
}

}  // namespace

void add_stream(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<StreamArguments>();
  CLI::App& command = *app.add_subcommand(
      "stream", "Read poses from stdin as JSON lines, ping at each, and write the echo lines");
  arguments->scene.add_to(command);
  add_value(command, "--layers", arguments->layers, "NAME,NAME",
            "The layers to write, by name (default: intensity)")
      ->delimiter(',');
  command.add_flag("--json", arguments->json,
                   "Write the values in the JSON line, not as a block of float32 after it");
  command.add_flag(
      "--answer-all", arguments->answer_all,
      "Answer every request with at least one line: a move with {\"moved\": NUMBER}, a "
      "removal with {\"removed\": NUMBER}, and a faulty request with {\"error\": "
      "MESSAGE} instead of ending");
  add_cache(command, arguments->cache);
  add_memory(command, arguments->memory);
  add_quiet(command, arguments->quiet, "No progress");
  command.callback([&action, arguments] { action = [arguments] { stream(*arguments); }; });
}

}  // namespace ensonify::engine::app
