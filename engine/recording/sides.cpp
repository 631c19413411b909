#include <ensonify/engine/recording/sides.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
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

constexpr std::size_t block_pings = 8;  // a mean of pings has less speckle, so its edge is clear
constexpr std::size_t usual_bins = 256, fewest_bins = 32;

/// The mean of the natural logarithm of the amplitudes in `block_pings` pings from `first` on, for
/// each bin of range. Empty if the pings are silent, have too few samples, or differ in length.
std::vector<double> profile(const RecordedLine& line, Side side, std::size_t first) {
  const std::size_t samples = line.pings[first].samples - line.pings[first].unrecorded;
  if (samples < fewest_bins) return {};
  const std::size_t width = std::max<std::size_t>(1, samples / usual_bins), bins = samples / width;
  std::vector<double> means;
  double sum = 0.0;
  for (std::size_t ping = first; ping < first + block_pings; ++ping) {
    if (line.pings[ping].samples - line.pings[ping].unrecorded != samples) return {};
    const std::span<const float> row = line.row(side, ping).subspan(line.pings[ping].unrecorded);
    for (std::size_t bin = 0; bin < bins; ++bin) {
      double mean = 0.0;
      for (const float amplitude : row.subspan(bin * width, width))
        mean += amplitude / static_cast<double>(width);
      means.push_back(mean);
      sum += mean;
    }
  }
  if (!(sum > 0.0)) return {};
  const double least = 0.01 * sum / static_cast<double>(means.size());  // so that log(0) is finite
  std::vector<double> logarithms(bins, 0.0);
  for (std::size_t i = 0; i < means.size(); ++i)
    logarithms[i % bins] += std::log(means[i] + least) / double{block_pings};
  return logarithms;
}

/// How sharply a profile rises out of a dark beginning. For each place this is the mean of a short
/// window behind the place, minus the larger of two means: of the window before the place, and of
/// everything before the place. The largest such difference is returned. The first window is not
/// used, because the transmit leakage may be bright there.
double edge(std::span<const double> profile) {
  const std::size_t window = std::max<std::size_t>(1, profile.size() / 50),
                    last = profile.size() * 3 / 5;
  std::vector<double> sums{0.0};
  for (const double value : profile) sums.push_back(sums.back() + value);
  const auto mean = [&](std::size_t begin, std::size_t end) {
    return (sums[end] - sums[begin]) / static_cast<double>(end - begin);
  };
  double best = -std::numeric_limits<double>::infinity();
  for (std::size_t k = 2 * window; k < last; ++k) {
    const double behind = mean(k, k + window);
    best = std::max(best, behind - std::max(mean(k - window, k), mean(window, k)));
  }
  return best;
}

bool is_reversed(const RecordedLine& line, Side side) {
  constexpr double clear = 0.7;     // of an edge: a factor of two in amplitude
  constexpr double clearer = 0.4;   // than the edge from the other end: a factor of 1.5
  constexpr std::size_t least = 3;  // least ratio of reversed blocks to blocks in the right order
  std::size_t blocks = 0, right = 0, reversed = 0;
  for (std::size_t first = 0; first + block_pings <= line.pings.size(); first += block_pings) {
    std::vector<double> amplitudes = profile(line, side, first);
    if (amplitudes.empty()) continue;
    ++blocks;
    const double near = edge(amplitudes);
    std::ranges::reverse(amplitudes);
    const double far = edge(amplitudes);
    right += near > clear && near > far + clearer;
    reversed += far > clear && near < clear && far > near + clearer;
  }
  return 2 * reversed >= std::max<std::size_t>(blocks, 1) && reversed >= least * right;
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

void turn_reversed_sides(RecordedLine& line, std::string_view name) {
  if (std::ranges::any_of(line.pings, [](const RecordedPing& ping) { return ping.one_sided > 0; }))
    return;
  for (const Side side : line.sides()) {
    if (!is_reversed(line, side)) continue;
    std::vector<float>& rows = side == Side::port ? line.port : line.starboard;
    for (std::size_t i = 0; i < line.pings.size(); ++i) {
      const auto row = rows.begin() + static_cast<std::ptrdiff_t>(i * line.samples);
      std::reverse(row + static_cast<std::ptrdiff_t>(line.pings[i].unrecorded),
                   row + static_cast<std::ptrdiff_t>(line.pings[i].samples));
    }
    line.warnings.push_back(fmt::format(
        "{}: the samples of {} are in the other order than the format says: the water column is at "
        "their far end; turned",
        name, name_of(side)));
  }
}

}  // namespace ensonify::engine
