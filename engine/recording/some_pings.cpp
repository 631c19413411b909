#include <ensonify/engine/recording/some_pings.h>

#include <algorithm>
#include <span>
#include <tuple>

#include <fmt/format.h>

namespace ensonify::engine {

RecordedLine some_pings(const RecordedLine& line, const std::vector<std::size_t>& indices) {
  RecordedLine some = line;
  some.pings.clear();
  some.port.clear();
  some.starboard.clear();
  for (const std::size_t i : indices) {
    some.pings.push_back(line.pings[i]);
    for (const Side side : line.sides()) {
      const std::span<const float> row = line.row(side, i);
      std::vector<float>& rows = side == Side::port ? some.port : some.starboard;
      rows.insert(rows.end(), row.begin(), row.end());
    }
  }
  return some;
}

void set_samples(RecordedLine& line, std::size_t samples) {
  if (line.samples == samples) return;
  for (std::vector<float>* side : {&line.port, &line.starboard}) {
    if (side->empty()) continue;
    std::vector<float> rows(line.pings.size() * samples, 0.0f);
    for (std::size_t ping = 0; ping < line.pings.size(); ++ping)
      std::copy_n(side->begin() + static_cast<std::ptrdiff_t>(ping * line.samples),
                  std::min(line.samples, samples),
                  rows.begin() + static_cast<std::ptrdiff_t>(ping * samples));
    *side = std::move(rows);
  }
  line.samples = samples;
}

AlikePings alike_pings(RecordedLine line) {
  std::size_t one_sided = 0;
  for (RecordedPing& ping : line.pings) {
    if (ping.one_sided == 0) continue;
    const std::size_t common = ping.samples - ping.one_sided;
    ping.range_m *= static_cast<double>(common) / static_cast<double>(ping.samples);
    ping.samples = common;
    ping.unrecorded = std::min(ping.unrecorded, common);
    ping.one_sided = 0;
    ++one_sided;
  }
  std::string left_out;
  if (one_sided > 0)
    left_out = fmt::format(
        "in {} pings one side ends at a shorter range, and the samples beyond it of the other are "
        "left out",
        one_sided);
  const std::vector<RecordedPing>& pings = line.pings;
  const auto states_range = [](const RecordedPing& ping) { return ping.range_m > 0.0; };
  const bool most_state = 2 * std::ranges::count_if(pings, states_range) >= std::ssize(pings);
  std::vector<std::size_t> sorted;
  for (std::size_t i = 0; i < pings.size(); ++i)
    if (states_range(pings[i]) == most_state) sorted.push_back(i);
  std::ranges::sort(
      sorted, {}, [&](std::size_t i) { return std::tuple(pings[i].samples, pings[i].range_m, i); });
  // Some recorders compute the range with the ping's sound speed, so the range varies a little.
  constexpr double one_range = 1.01;
  std::span<const std::size_t> most;
  for (auto first = sorted.begin(), end = first; first != sorted.end(); ++first) {
    while (end != sorted.end() && pings[*end].samples == pings[*first].samples &&
           pings[*end].range_m <= one_range * pings[*first].range_m)
      ++end;
    const std::span<const std::size_t> alike(first, end);
    if (alike.size() > most.size() || (alike.size() == most.size() && alike.front() < most.front()))
      most = alike;
  }
  if (most.size() < pings.size()) {
    std::vector<std::size_t> kept(most.begin(), most.end());
    std::ranges::sort(kept);
    left_out +=
        fmt::format("{}{} of {} pings have another range or length than most and are left out",
                    left_out.empty() ? "" : "; ", pings.size() - kept.size(), pings.size());
    line = some_pings(line, kept);
  }
  if (!line.pings.empty()) set_samples(line, line.pings.front().samples);
  return {std::move(line), std::move(left_out)};
}

}  // namespace ensonify::engine
