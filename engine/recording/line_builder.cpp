#include <ensonify/engine/recording/line_builder.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <ensonify/engine/recording/recording_reader.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t max_padding = 16;       // most values of the rows per sample of the file
constexpr std::size_t small_line = 1u << 20;  // below this number of values any padding is allowed

}  // namespace

std::string impossible_value(std::string_view name, std::size_t pings, std::string_view what,
                             std::uint64_t first, std::string_view value) {
  return fmt::format("{}: {} pings state an impossible {}; the first is ping {}, with {}", name,
                     pings, what, first, value);
}

void LineBuilder::impossible(const std::string& what, std::uint64_t ping, std::string_view value) {
  Impossible& these = impossible_[what];
  if (these.pings > 0 && these.last == ping) return;
  if (++these.pings == 1) {
    these.first = ping;
    these.value = value;
  }
  these.last = ping;
}

void LineBuilder::add(int line, const RecordedPing& ping, Side side, std::vector<float> samples) {
  Entry& entry = entries_[line];
  std::vector<RecordedPing>& pings = entry.line.pings;
  const auto its = side == Side::port ? &Sides::port : &Sides::starboard;
  if (pings.empty() || pings.back().number != ping.number || !(entry.sides.back().*its).empty()) {
    pings.push_back(ping);
    entry.sides.emplace_back();
  }
  Sides& sides = entry.sides.back();
  (side == Side::port ? sides.port_sample_m : sides.starboard_sample_m) =
      ping.range_m / static_cast<double>(samples.size());
  sides.*its = std::move(samples);
}

// A recorder may store one side with fewer samples than the other side, or to a shorter range.
void LineBuilder::make_samples_alike(Entry& entry, std::string_view name) {
  constexpr double alike = 0.01;
  std::size_t repeated = 0, other_ranges = 0;
  double port_m = 0.0, starboard_m = 0.0;  // sample lengths in the last ping with repeated samples
  for (std::size_t i = 0; i < entry.sides.size(); ++i) {
    Sides& sides = entry.sides[i];
    RecordedPing& ping = entry.line.pings[i];
    if (sides.port.empty() || sides.starboard.empty() || !(sides.port_sample_m > 0.0) ||
        !(sides.starboard_sample_m > 0.0))
      continue;
    const std::size_t longest = max_padding * std::max(sides.port.size(), sides.starboard.size());
    const bool of_port = sides.port_sample_m > sides.starboard_sample_m;
    std::vector<float>& coarse = of_port ? sides.port : sides.starboard;
    const double fine_m = std::min(sides.port_sample_m, sides.starboard_sample_m),
                 ratio = std::max(sides.port_sample_m, sides.starboard_sample_m) / fine_m,
                 length = std::round(ratio * static_cast<double>(coarse.size()));
    if (ratio > 1.0 + alike && length <= static_cast<double>(longest)) {
      ++repeated;
      port_m = sides.port_sample_m;
      starboard_m = sides.starboard_sample_m;
      std::vector<float> fine(static_cast<std::size_t>(length));
      for (std::size_t k = 0; k < fine.size(); ++k)
        fine[k] = coarse[std::min(static_cast<std::size_t>((static_cast<double>(k) + 0.5) / ratio),
                                  coarse.size() - 1)];
      if (of_port)
        ping.unrecorded =
            static_cast<std::size_t>(std::round(ratio * static_cast<double>(ping.unrecorded)));
      coarse = std::move(fine);
    }
    const auto [shorter, longer] = std::minmax({sides.port.size(), sides.starboard.size()});
    ping.range_m = fine_m * static_cast<double>(longer);
    if (static_cast<double>(shorter) >= (1.0 - alike) * static_cast<double>(longer)) continue;
    ping.one_sided = longer - shorter;
    ++other_ranges;
  }
  if (repeated > 0)
    entry.line.warnings.push_back(fmt::format(
        "{}: in {} pings a sample is {:.3g} m long on port and {:.3g} m on starboard; the longer ones "
        "are repeated, so that both sides have samples of the same length",
        name, repeated, port_m, starboard_m));
  if (other_ranges > 0)
    entry.line.warnings.push_back(fmt::format(
        "{}: in {} pings one side ends at a shorter range than the other; beyond it, its "
        "samples are 0",
        name, other_ranges));
}

// An XTF file has two channels for each sonar, even if the sonar has one side.
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

template <class IsOne>
std::string LineBuilder::list_of_others(IsOne&& is_one) const {
  std::vector<std::string> list;
  for (const auto& [what, count] : others_)
    if (is_one(what)) list.push_back(fmt::format("{} ({})", what, count));
  return fmt::format("{}", fmt::join(list, " and "));
}

std::vector<RecordedLine> LineBuilder::finish(std::string_view name) {
  std::vector<RecordedLine> lines;
  for (auto& numbered : entries_) {
    Entry& entry = numbered.second;
    RecordedLine& line = entry.line;
    leave_out_silent_side(entry, name);
    make_samples_alike(entry, name);
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
    if (!navigation_.empty() && std::ranges::none_of(line.pings, [](const RecordedPing& ping) {
          return ping.place || ping.place_m;
        }))
      line.warnings.push_back(fmt::format(
          "{}: its pings have no places; places in {} are not read", name,
          list_of_others([&](const std::string& what) { return navigation_.contains(what); })));
    for (const auto& [what, these] : impossible_)
      line.warnings.push_back(impossible_value(name, these.pings, what, these.first, these.value));
    lines.push_back(std::move(line));
  }
  if (lines.empty()) {
    const std::string has = list_of_others([](const std::string&) { return true; });
    throw RecordingError(
        fmt::format("{}: has no sidescan samples{}, expected a recording of a sidescan sonar", name,
                    has.empty() ? "" : "; it has " + has));
  }
  return lines;
}

}  // namespace ensonify::engine
