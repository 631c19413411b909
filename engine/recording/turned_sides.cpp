#include <ensonify/engine/recording/turned_sides.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include <fmt/format.h>

namespace ensonify::engine {
namespace {

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
