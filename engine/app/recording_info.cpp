#include <ensonify/engine/recording/recording_reader.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app.h"

namespace ensonify::engine::app {
namespace {

namespace fs = std::filesystem;

/// How many numbers are missing between the numbers of the pings.
std::uint64_t lost_pings(const RecordedLine& line) {
  std::uint64_t lost = 0;
  for (std::size_t i = 1; i < line.pings.size(); ++i)
    if (line.pings[i].number > line.pings[i - 1].number)
      lost += line.pings[i].number - line.pings[i - 1].number - 1;
  return lost;
}

/// What the command prints: names and values, in this order.
nlohmann::ordered_json facts_of(const RecordedLine& line) {
  nlohmann::ordered_json facts = {{"format", line.format}};
  if (!line.sonar.empty()) facts["sonar"] = line.sonar;
  facts["sides"] = line.port.empty() ? "starboard" : line.starboard.empty() ? "port" : "both";
  facts["pings"] = line.pings.size();
  facts["lost_pings"] = lost_pings(line);
  facts["samples"] = line.samples;
  const auto stated = [&](const char* name, double value) {
    if (value > 0.0) facts[name] = value;
  };
  stated("frequency_hz", line.frequency_hz);
  stated("bandwidth_hz", line.bandwidth_hz);
  stated("pulse_length_s", line.pulse_length_s);
  stated("sound_speed_mps", line.sound_speed_mps);
  for (const PingColumn& column : ping_columns()) {
    std::optional<double> least, greatest;
    for (const RecordedPing& ping : line.pings)
      if (const std::optional<double> value = column.value(ping)) {
        least = std::min(least.value_or(*value), *value);
        greatest = std::max(greatest.value_or(*value), *value);
      }
    if (!least) continue;
    facts[fmt::format("{}_min", column.name)] = *least;
    facts[fmt::format("{}_max", column.name)] = *greatest;
  }
  return facts;
}

void print_info(const std::vector<fs::path>& files, bool json) {
  const std::vector<RecordedLine> lines = read_recordings(files);
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  std::string out;
  std::vector<std::string> warnings;  // each once: lines of one file may share them
  for (const RecordedLine& line : lines) {
    for (const std::string& warning : line.warnings)
      if (std::ranges::find(warnings, warning) == warnings.end()) warnings.push_back(warning);
    const nlohmann::ordered_json facts = facts_of(line);
    if (!out.empty()) out += '\n';
    for (const auto& [name, value] : facts.items())
      out +=
          fmt::format("{} {}\n", name, value.is_string() ? value.get<std::string>() : value.dump());
    all.push_back(facts);
  }
  print_warnings(warnings);
  if (json)
    print_object({{"lines", all}});
  else
    print(out);
}

}  // namespace

void add_recording_info(CLI::App& app, Action& action) {
  const auto files = std::make_shared<std::vector<fs::path>>();
  const auto json = std::make_shared<bool>(false);
  CLI::App& command = *app.add_subcommand(
      "recording-info",
      "Describe a sidescan recording (XTF, JSF). Prints one `name value` per line, in metres, "
      "degrees and seconds, for each sonar or frequency. What the file does not state is left out");
  command
      .add_option("FILE", *files,
                  "The recording; or its files in their order, also those of port and of starboard")
      ->required();
  command.add_flag("--json", *json, "Print one JSON object");
  command.callback([&action, files, json] { action = [=] { print_info(*files, *json); }; });
}

}  // namespace ensonify::engine::app
