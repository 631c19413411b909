#include <ensonify/engine/comparison/bed_drift.h>

#include <algorithm>
#include <array>
#include <vector>

namespace ensonify::engine {
namespace {

constexpr std::size_t max_shift = 24;                         // samples
constexpr std::size_t around_pings = 4, around_samples = 15;  // of a local mean, either way
constexpr double peak = 3.0;                                  // over the mean; more is an object
constexpr double alike = 0.04;                                // correlation of a clear peak
constexpr std::size_t shifts = 2 * max_shift + 1;

/// A row divided by its local mean, less 1; 0 before the bed begins.
class Texture {
 public:
  Texture(const RecordedLine& line, Side side, std::size_t first, std::size_t end)
      : line_(line), side_(side), first_(first), end_(end), sums_(line.samples + 1) {}

  void take(std::size_t ping, std::size_t begin, std::vector<float>& to) {
    const std::size_t low = ping < first_ + around_pings ? first_ : ping - around_pings,
                      high = std::min(ping + around_pings + 1, end_);
    std::ranges::fill(sums_, 0.0);
    for (std::size_t i = low; i < high; ++i) {
      const std::span<const float> row = line_.row(side_, i);
      for (std::size_t k = 0; k < row.size(); ++k) sums_[k + 1] += row[k];
    }
    for (std::size_t k = 0; k < line_.samples; ++k) sums_[k + 1] += sums_[k];
    const std::span<const float> row = line_.row(side_, ping);
    to.assign(line_.samples, 0.0f);
    for (std::size_t k = begin; k < line_.samples; ++k) {
      const std::size_t from = std::max(begin, k < around_samples ? 0 : k - around_samples),
                        until = std::min(k + around_samples + 1, line_.samples);
      const double mean =
          (sums_[until] - sums_[from]) / static_cast<double>((until - from) * (high - low));
      if (mean > 0.0) to[k] = static_cast<float>(std::min(row[k] / mean - 1.0, peak));
    }
  }

 private:
  const RecordedLine& line_;
  Side side_;
  std::size_t first_, end_;
  std::vector<double> sums_;
};

}  // namespace

std::optional<double> bed_drift_m(const RecordedLine& line, Side side,
                                  std::span<const std::size_t> bed, std::size_t first,
                                  std::size_t end) {
  if (end < first + 2) return std::nullopt;
  Texture texture(line, side, first, end);
  std::vector<float> before, now;
  std::array<double, shifts> products{};
  double power = 0.0, sample_m = 0.0;
  std::size_t last_begin = line.samples;
  for (std::size_t ping = first; ping < end; ++ping) {
    std::swap(before, now);
    const std::size_t begin = 2 * bed[ping];  // 30 degrees
    const bool shows = begin > 0 && begin + 4 * max_shift < line.samples;
    if (shows) texture.take(ping, begin, now);
    const std::size_t from = std::max(begin, last_begin) + max_shift;
    if (shows && ping > first && last_begin < line.samples && from + 2 * max_shift < line.samples) {
      for (std::size_t k = from; k + max_shift < line.samples; ++k) {
        for (std::size_t shift = 0; shift < shifts; ++shift)
          products[shift] += double(before[k]) * now[k + shift - max_shift];
        power += double(before[k]) * before[k];
      }
      sample_m = line.pings[ping].range_m / static_cast<double>(line.samples);
    }
    last_begin = shows ? begin : line.samples;
  }
  const auto best = std::ranges::max_element(products);
  if (!(sample_m > 0.0) || !(*best > alike * power) || best - products.begin() < 2 ||
      products.end() - best < 3)
    return std::nullopt;
  // The peak between samples: the centre of gravity of the three largest products, less the larger
  // of the two next to them (an object correlates at many shifts). A parabola through the three
  // would be biased to whole samples.
  const double around = std::max(best[-2], best[2]), below = std::max(best[-1] - around, 0.0),
               above = std::max(best[1] - around, 0.0);
  const double off = (above - below) / (below + (*best - around) + above);
  return sample_m * (static_cast<double>(best - products.begin()) + off - double{max_shift});
}

std::optional<double> sideways_drift_m(std::optional<double> port_m,
                                       std::optional<double> starboard_m) {
  if (!port_m || !starboard_m) return std::nullopt;
  return 0.5 * (*starboard_m - *port_m);
}

}  // namespace ensonify::engine
