#include <ensonify/engine/imitation/ping_gains.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>

#include <ensonify/engine/base/quantile.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

/// The logarithm of the mean amplitude of a ping's bed, in its near and its far half; the mean of
/// both sides. Not finite for a ping without a bed.
struct Brightness {
  double near = 0.0, far = 0.0;
  double both() const { return 0.5 * (near + far); }
};

double log_mean(std::span<const float> samples, const RecorderSigns& recorder) {
  double sum = 0.0;
  for (const float value : samples) sum += expanded(value / recorder.full_scale, recorder);
  return std::log(sum / static_cast<double>(samples.size()));
}

std::vector<Brightness> brightness_of(const LineWithBed& line, const RecorderSigns& recorder) {
  std::vector<Brightness> all(line.pings.size());
  const auto sides = line.sides();
  const double share = 1.0 / static_cast<double>(sides.size());
  for (const Side side : sides) {
    const std::vector<std::size_t>& bed = line.bed(side).edge;
    for (std::size_t ping = 0; ping < all.size(); ++ping) {
      // Not too near the first return, whose level changes with the altitude.
      const std::size_t begin = std::min(bed[ping] + bed[ping] / 4 + 1, line.samples);
      const std::span<const float> row = line.row(side, ping).subspan(begin);
      all[ping].near += share * log_mean(row.first(row.size() / 2), recorder);
      all[ping].far += share * log_mean(row.subspan(row.size() / 2), recorder);
    }
  }
  return all;
}

/// A robust covariance: a quarter of (variance of the sum minus variance of the difference)
/// (Gnanadesikan and Kettenring, Biometrics 28, 81, 1972).
double robust_covariance(std::span<const Brightness> pairs) {
  std::vector<double> sums, differences;
  for (const Brightness& pair : pairs) {
    sums.push_back(pair.near + pair.far);
    differences.push_back(pair.near - pair.far);
  }
  return 0.25 * (std::pow(robust_deviation(std::move(sums)), 2) -
                 std::pow(robust_deviation(std::move(differences)), 2));
}

}  // namespace

PingGains ping_gains(const LineWithBed& line, const RecorderSigns& recorder) {
  constexpr double noticed = 0.03;                // share of the amplitude
  constexpr std::size_t fewest = 50, reach = 10;  // pings
  PingGains found;
  if (recorder.has_automatic_gain() || recorder.ping_mean > 0.0) return found;
  const std::vector<Brightness> brightness = brightness_of(line, recorder);
  std::vector<Brightness> changes;
  for (std::size_t i = 0; i + 1 < brightness.size(); ++i) {
    const Brightness &one = brightness[i], &next = brightness[i + 1];
    if (std::isfinite(one.both() + next.both()))
      changes.push_back({next.near - one.near, next.far - one.far});
  }
  if (changes.size() < fewest) return found;
  const double variance = 0.5 * robust_covariance(changes);  // of one gain; a change has two
  if (!(variance > noticed * noticed)) return found;
  found.rms_db = scatter::amplitude_to_db(std::exp(std::sqrt(variance)));
  // How much each ping differs from those around. The gain's part of this is its share of the
  // variance.
  std::vector<double> off(brightness.size(), 0.0);
  for (std::size_t i = 0; i < off.size(); ++i) {
    if (!std::isfinite(brightness[i].both())) continue;
    std::vector<double> around;
    for (std::size_t k = i < reach ? 0 : i - reach; k < std::min(i + reach + 1, off.size()); ++k)
      if (std::isfinite(brightness[k].both())) around.push_back(brightness[k].both());
    off[i] = brightness[i].both() - median(std::move(around));
  }
  const double share = std::min(1.0, variance / std::pow(robust_deviation(off), 2));
  for (const double one : off) found.factors.push_back(std::exp(share * one));
  return found;
}

LineWithBed without_ping_gains(const LineWithBed& line, const PingGains& gains,
                               const RecorderSigns& recorder) {
  if (gains.factors.empty()) return line;
  auto even = static_cast<const RecordedLine&>(line);  // without beds
  for (const Side side : line.sides()) {
    std::vector<float>& rows = side == Side::port ? even.port : even.starboard;
    for (std::size_t ping = 0; ping < line.pings.size(); ++ping) {
      const double factor = gains.factors[ping];
      for (float& value : std::span(rows).subspan(ping * line.samples, line.samples))
        value = static_cast<float>(
            recorder.curve == TransferCurve::linear ? value / factor
            : recorder.curve == TransferCurve::square_root
                ? value / std::sqrt(factor)
                : std::max(0.0, value - recorder.full_scale * scatter::amplitude_to_db(factor) /
                                            recorder.curve_range_db));
    }
  }
  return LineWithBed(std::move(even));
}

}  // namespace ensonify::engine
