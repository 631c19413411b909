#include <ensonify/engine/comparison/bed_drift.h>

#include <algorithm>
#include <array>
#include <vector>

namespace ensonify::engine {
namespace {

constexpr std::size_t max_shift = 24;                         // samples
constexpr std::size_t around_pings = 4, around_samples = 15;  // of a local mean, in each direction
constexpr double peak = 3.0;                                  // largest texture; more is an object
constexpr double alike = 0.04;                                // least correlation of a clear peak
constexpr std::size_t shifts = 2 * max_shift + 1;

/// The texture of a ping: its row divided by the local mean, minus 1; 0 before the bed.
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

/// Sums for the correlation of pings with the pings `lag` pings later. The shift number `shift` is
/// a shift by shift - max_shift samples.
struct ShiftedProducts {
  std::array<double, shifts> products{};
  double power = 0.0, sample_m = 0.0;  ///< sample_m is 0 if there are no pings to compare

  double correlation(std::size_t shift) const { return products[shift] / power; }
  std::size_t best() const {
    return static_cast<std::size_t>(std::ranges::max_element(products) - products.begin());
  }
};
ShiftedProducts shifted_products(const RecordedLine& line, Side side,
                                 std::span<const std::size_t> bed, std::size_t first,
                                 std::size_t end, std::size_t lag) {
  ShiftedProducts sums;
  Texture texture(line, side, first, end);
  std::vector<std::vector<float>> rows(lag + 1);  // textures of the newest pings
  std::vector<std::size_t> begins(lag + 1, line.samples);
  for (std::size_t ping = first; ping < end; ++ping) {
    std::vector<float>& now = rows[ping % (lag + 1)];
    const std::vector<float>& before = rows[(ping + 1) % (lag + 1)];
    const std::size_t begin = 2 * bed[ping];  // grazing angle of 30 degrees
    const bool shows = begin > 0 && begin + 4 * max_shift < line.samples;
    if (shows) texture.take(ping, begin, now);
    const std::size_t before_begin = begins[(ping + 1) % (lag + 1)],
                      from = std::max(begin, before_begin) + max_shift;
    if (shows && before_begin < line.samples && from + 2 * max_shift < line.samples) {
      for (std::size_t k = from; k + max_shift < line.samples; ++k) {
        for (std::size_t shift = 0; shift < shifts; ++shift)
          sums.products[shift] += double(before[k]) * now[k + shift - max_shift];
        sums.power += double(before[k]) * before[k];
      }
      sums.sample_m = line.pings[ping].range_m / static_cast<double>(line.samples);
    }
    begins[ping % (lag + 1)] = shows ? begin : line.samples;
  }
  return sums;
}

}  // namespace

std::optional<double> bed_drift_m(const RecordedLine& line, Side side,
                                  std::span<const std::size_t> bed, std::size_t first,
                                  std::size_t end) {
  if (end < first + 2) return std::nullopt;
  const ShiftedProducts next = shifted_products(line, side, bed, first, end, 1);
  const std::size_t best = next.best();
  if (!(next.sample_m > 0.0) || !(next.products[best] > alike * next.power) || best < 2 ||
      best + 3 > shifts)
    return std::nullopt;
  // The peak lies between samples. It is the centre of gravity of the three products at the peak,
  // after the larger of the two products beside these three is subtracted, because an object
  // correlates at many shifts. A parabola through the three would be biased to whole samples.
  const double* const at = &next.products[best];
  const double around = std::max(at[-2], at[2]), below = std::max(at[-1] - around, 0.0),
               above = std::max(at[1] - around, 0.0);
  const double off = (above - below) / (below + (*at - around) + above);
  return next.sample_m * (static_cast<double>(best) + off - double{max_shift});
}

double lasting_likeness(const RecordedLine& line, Side side, std::span<const std::size_t> bed,
                        std::size_t first, std::size_t end, std::size_t lag) {
  const ShiftedProducts next = shifted_products(line, side, bed, first, end, 1),
                        later = shifted_products(line, side, bed, first, end, lag);
  return later.correlation(later.best()) / next.correlation(next.best());
}

std::optional<double> sideways_drift_m(std::optional<double> port_m,
                                       std::optional<double> starboard_m) {
  if (!port_m || !starboard_m) return std::nullopt;
  return 0.5 * (*starboard_m - *port_m);
}

}  // namespace ensonify::engine
