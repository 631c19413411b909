#include <ensonify/engine/recording/joined_sides.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/recording/line_builder.h>

namespace ensonify::engine {
namespace {

/// The index of a ping in two lines; unset in a line that lacks the ping.
struct BothPings {
  std::optional<std::size_t> in_line, in_other;
};

/// The pings of both lines, in ascending order; pings that both lines have are one element.
std::vector<BothPings> both_pings(const RecordedLine& line, const RecordedLine& other) {
  constexpr double same_s = 1.0;
  const auto key = [](const RecordedPing& ping) {
    return std::tuple(ping.number, ping.t_s.value_or(0.0), ping.beam);
  };
  std::vector<BothPings> all;
  for (std::size_t i = 0, k = 0; i < line.pings.size() || k < other.pings.size();) {
    if (i == line.pings.size()) {
      all.push_back({std::nullopt, k++});
    } else if (k == other.pings.size()) {
      all.push_back({i++, std::nullopt});
    } else {
      const RecordedPing &a = line.pings[i], &b = other.pings[k];
      if (a.number == b.number && a.beam == b.beam &&
          (!a.t_s || !b.t_s || std::abs(*a.t_s - *b.t_s) < same_s))
        all.push_back({i++, k++});
      else if (key(a) < key(b))
        all.push_back({i++, std::nullopt});
      else
        all.push_back({std::nullopt, k++});
    }
  }
  return all;
}

}  // namespace

bool may_be_of_one_sonar(double port_hz, double starboard_hz) {
  constexpr double most_ratio = 1.2;
  const auto [low_hz, high_hz] = std::minmax(port_hz, starboard_hz);
  return low_hz <= 0.0 || high_hz <= most_ratio * low_hz;
}

bool are_sides_of_one(const RecordedLine& line, const RecordedLine& other) {
  if (line.sides().size() != 1 || other.sides().size() != 1 || line.sides() == other.sides() ||
      !may_be_of_one_sonar(line.frequency_hz, other.frequency_hz))
    return false;
  const std::vector<BothPings> all = both_pings(line, other);
  const auto both = std::ranges::count_if(
      all, [](const BothPings& ping) { return ping.in_line && ping.in_other; });
  return 2 * both >= std::min(std::ssize(line.pings), std::ssize(other.pings));
}

void join_sides(RecordedLine& line, const RecordedLine& other, std::string_view name) {
  LineBuilder builder(line.format);
  const auto add = [&](const RecordedLine& from, std::size_t ping) {
    const Side side = from.sides().front();
    const auto row = from.row(side, ping).first(from.pings[ping].samples);
    builder.add(0, from.pings[ping], side, {row.begin(), row.end()});
  };
  for (const BothPings& ping : both_pings(line, other)) {
    if (ping.in_line) add(line, *ping.in_line);
    if (ping.in_other) add(other, *ping.in_other);
  }
  RecordedLine joined = std::move(builder.finish(name).front());
  line.pings = std::move(joined.pings);
  line.samples = joined.samples;
  line.port = std::move(joined.port);
  line.starboard = std::move(joined.starboard);
  line.warnings.insert(line.warnings.end(), other.warnings.begin(), other.warnings.end());
  line.warnings.insert(line.warnings.end(), joined.warnings.begin(), joined.warnings.end());
  line.warnings.push_back(fmt::format("{}: has {} of the pings of a file before it; joined", name,
                                      name_of(other.sides().front())));
}

}  // namespace ensonify::engine
