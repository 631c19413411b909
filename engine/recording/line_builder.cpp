#include <ensonify/engine/recording/line_builder.h>

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/recording/recording_reader.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t max_padding = 16;       // values of the rows per sample of the file
constexpr std::size_t small_line = 1u << 20;  // samples: below, padding does no harm

}  // namespace

RecordedLine& LineBuilder::line(int number) { return entries_[number].line; }

void LineBuilder::add(int line, const RecordedPing& ping, Side side, std::vector<float> samples) {
  Entry& entry = entries_[line];
  std::vector<RecordedPing>& pings = entry.line.pings;
  const auto its = [side](Sides& sides) -> std::vector<float>& {
    return side == Side::port ? sides.port : sides.starboard;
  };
  if (pings.empty() || pings.back().number != ping.number || !its(entry.sides.back()).empty()) {
    pings.push_back(ping);
    entry.sides.emplace_back();
  }
  its(entry.sides.back()) = std::move(samples);
}

// An XTF has both channels of a sonar even if the sonar has one side.
void LineBuilder::leave_out_silent_side(Entry& entry, std::string_view name) {
  const auto sounds = [&](std::vector<float> Sides::*side) {
    return std::ranges::any_of(entry.sides, [&](const Sides& sides) {
      return std::ranges::any_of(sides.*side, [](float sample) { return sample != 0.0f; });
    });
  };
  const bool port_sounds = sounds(&Sides::port);
  if (port_sounds == sounds(&Sides::starboard)) return;
  const auto silent = port_sounds ? &Sides::starboard : &Sides::port;
  bool was_there = false;
  for (Sides& sides : entry.sides)
    was_there |= !std::exchange(sides.*silent, std::vector<float>()).empty();
  if (was_there)
    entry.line.warnings.push_back(
        fmt::format("{}: {} is 0 in every sample; left out, as if the file did not have this side",
                    name, port_sounds ? "starboard" : "port"));
}

std::vector<RecordedLine> LineBuilder::finish(std::string_view name) {
  std::vector<RecordedLine> lines;
  for (auto& numbered : entries_) {
    Entry& entry = numbered.second;
    RecordedLine& line = entry.line;
    leave_out_silent_side(entry, name);
    std::size_t of_port = 0, of_starboard = 0;
    for (std::size_t ping = 0; ping < line.pings.size(); ++ping) {
      const Sides& sides = entry.sides[ping];
      of_port += sides.port.size();
      of_starboard += sides.starboard.size();
      line.pings[ping].samples = std::max(sides.port.size(), sides.starboard.size());
      line.samples = std::max(line.samples, line.pings[ping].samples);
    }
    if (line.samples == 0) continue;
    const std::size_t row_values = line.samples * line.pings.size();
    if (row_values > small_line && row_values > max_padding * std::max(of_port, of_starboard))
      throw RecordingError(fmt::format(
          "{}: the longest ping has {} samples, but all {} pings together have only {}; expected "
          "pings of similar length",
          name, line.samples, line.pings.size(), std::max(of_port, of_starboard)));
    const auto lay = [&](std::vector<float> Sides::*side, std::vector<float>& rows) {
      rows.assign(row_values, 0.0f);
      for (std::size_t ping = 0; ping < line.pings.size(); ++ping) {
        std::vector<float>& samples = entry.sides[ping].*side;
        std::ranges::copy(samples, rows.begin() + static_cast<std::ptrdiff_t>(ping * line.samples));
        samples = {};
      }
    };
    if (of_port > 0) lay(&Sides::port, line.port);
    if (of_starboard > 0) lay(&Sides::starboard, line.starboard);
    line.format = format_;
    if (skipped_bytes_ > 0)
      line.warnings.push_back(fmt::format("{}: {} bytes between its packets are no packet; skipped",
                                          name, skipped_bytes_));
    if (cut_off_)
      line.warnings.push_back(fmt::format("{}: its last packet is cut off; left out", name));
    lines.push_back(std::move(line));
  }
  if (lines.empty())
    throw RecordingError(
        fmt::format("{}: has no sidescan samples, expected a recording of a sidescan sonar", name));
  return lines;
}

}  // namespace ensonify::engine
