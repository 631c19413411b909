#include <ensonify/engine/imitation/recorder_signs.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include <fmt/format.h>

#include <ensonify/engine/comparison/tone_change.h>
#include <ensonify/engine/imitation/vehicle_path.h>
#include <ensonify/engine/quantile.h>
#include <ensonify/engine/sonar/reception/transmit_leakage.h>
#include <ensonify/engine/units.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

void set_full_scale(const RecordedLine& line, RecorderSigns& signs) {
  float largest = 0.0f;
  std::size_t samples = 0;
  for (const Side side : line.sides())
    for (const float value : line.side(side)) largest = std::max(largest, value);
  std::size_t at_largest = 0;
  bool whole = true;
  for (const Side side : line.sides())
    for (const float value : line.side(side)) {
      at_largest += value == largest;
      whole = whole && value == std::floor(value);
      ++samples;
    }
  signs.clips =
      at_largest >= 20 && 1e5 * static_cast<double>(at_largest) > static_cast<double>(samples);
  signs.full_scale = largest;
  constexpr int max_bits = 16;
  const int bits =
      static_cast<int>(std::bit_width(static_cast<unsigned>(std::min(largest, 16777215.0f))));
  if (whole && bits >= 1 && bits <= max_bits) {
    signs.bits = bits;
    if (!signs.clips) signs.full_scale = static_cast<double>((1u << bits) - 1u);
    signs.bits_from = {Confidence::measured,
                       fmt::format("the largest sample is {:.0f}{}", largest,
                                   signs.clips ? ", and many are as large: it clips there" : "")};
  } else {
    signs.bits_from = {Confidence::assumed, "its samples are no whole numbers of up to 16 bits"};
  }
}

/// The blocks of the bed without clipped samples.
struct Spread {
  double mean, sd, skew, grazing_rad;
};
std::vector<Spread> spreads(const RecordedLine& line, double full_scale) {
  std::vector<Spread> all;
  for (const Side side : line.sides()) {
    const std::vector<std::size_t> bed = bed_edge(line, side);
    for (std::size_t ping = 0; ping + block_pings <= line.pings.size(); ping += block_pings) {
      const std::size_t begin =
          *std::max_element(bed.begin() + static_cast<std::ptrdiff_t>(ping),
                            bed.begin() + static_cast<std::ptrdiff_t>(ping + block_pings));
      for (std::size_t k = begin; k + block_samples <= line.samples; k += block_samples) {
        double sum = 0.0, squares = 0.0, cubes = 0.0;
        bool clipped = false;
        for (std::size_t i = 0; i < block_pings; ++i)
          for (const float value : line.row(side, ping + i).subspan(k, block_samples)) {
            sum += value;
            squares += double(value) * value;
            cubes += double(value) * value * value;
            clipped = clipped || value >= full_scale;
          }
        constexpr auto count = static_cast<double>(block_pings * block_samples);
        const double mean = sum / count, variance = squares / count - mean * mean;
        if (!clipped && mean > 0.0 && variance > 0.0)
          all.push_back(
              {mean, std::sqrt(variance),
               (cubes / count - mean * (3.0 * variance + mean * mean)) / std::pow(variance, 1.5),
               std::asin(static_cast<double>(begin) / static_cast<double>(k + block_samples / 2))});
      }
    }
  }
  return all;
}

/// Where the spread of the samples stays the same while their mean grows, and they are skewed to
/// the low side, the curve is logarithmic; Rayleigh amplitudes are skewed to the high side. Relief,
/// shadows and texture only increase the spread, so the blocks with the smallest spread are used.
void set_curve(std::vector<Spread> blocks, RecorderSigns& signs) {
  constexpr double quietest = 0.2;
  signs.curve_from = {Confidence::assumed, "too few unclipped samples of the bed"};
  if (blocks.size() < 100) return;
  std::ranges::sort(blocks, {}, &Spread::mean);
  // By fifths of the blocks' means.
  const std::size_t fifth = blocks.size() / 5;
  std::vector<double> at_low, at_high, skews;
  for (std::size_t i = 0; i < fifth; ++i) {
    at_low.push_back(blocks[i].sd);
    const Spread& high = blocks[blocks.size() - 1 - i];
    at_high.push_back(high.sd);
    skews.push_back(high.skew);
  }
  const double mean_ratio =
      std::log(blocks[blocks.size() - fifth / 2].mean / blocks[fifth / 2].mean);
  const double growth =
      std::log(quantile(std::move(at_high), quietest) / quantile(std::move(at_low), quietest)) /
      mean_ratio;
  const double skew = median(std::move(skews));
  if (!(mean_ratio > 0.1)) {
    signs.curve_from.why = "the level of the bed hardly changes: taken as linear";
    return;
  }
  signs.curve_from = {
      Confidence::measured,
      fmt::format("over the bed the spread grows as mean^{:.1f}, with a skew of {:.1f}", growth,
                  skew)};
  // A square root, with a skew of -0.1, is distinguished later. A logarithm has about -0.9,
  // whatever the spread seems to do where the level hardly changes.
  if (skew > -0.4 && (growth > 0.4 || skew > 0.0)) return;
  signs.curve = TransferCurve::logarithmic;
  // A Rayleigh amplitude in decibels has a standard deviation of 5.57 dB (Ulaby and others,
  // Microwave Remote Sensing, vol. 2, ch. 7).
  std::vector<double> sds;
  for (const Spread& block : blocks) sds.push_back(block.sd);
  signs.curve_range_db =
      std::clamp(5.57 / (median(std::move(sds)) / signs.full_scale), 20.0, 200.0);
}

/// The number of looks whose speckle has the contrast.
int looks_of(double contrast, Detector detector, TransferCurve curve) {
  constexpr int most = 16;
  int looks = 1;
  const auto off = [&](int number) {
    return std::abs(speckle_of(detector, number, curve).contrast - contrast);
  };
  while (looks < most && off(looks + 1) < off(looks)) ++looks;
  return looks;
}

/// Distinguishes a square root from a line by the speckle's contrast and skewness: of a root both
/// are small, and a line with as small a contrast, of several looks, is clearly skewed.
void tell_root(const Speckle& found, RecorderSigns& signs) {
  const double line_skew = speckle_of(signs.detector, looks_of(found.contrast, signs.detector,
                                                               TransferCurve::linear))
                               .skew,
               largest_contrast =
                   speckle_of(signs.detector, 1, TransferCurve::square_root).contrast;
  constexpr double root_share = 0.4, line_share = 0.55, least_skew = -0.2, uneven = 1.2;
  if (found.skew > line_share * line_skew) return;
  const std::string speckle =
      fmt::format("the speckle of a smooth bed has a contrast of {:.2f} and a skew of {:.1f}",
                  found.contrast, found.skew);
  if (found.skew > least_skew && found.skew < root_share * line_skew &&
      found.contrast < uneven * largest_contrast) {
    signs.curve = TransferCurve::square_root;
    signs.curve_from = {Confidence::measured, speckle};
  } else {
    signs.curve_from = {Confidence::assumed, speckle + ": linear or square root"};
  }
}

void set_looks(const RecordedLine& line, const std::vector<Spread>& blocks, RecorderSigns& signs) {
  signs.detector = line.peak_detector ? Detector::peak : Detector::mean;
  signs.looks_from = {Confidence::assumed, "too few unclipped samples of the bed"};
  if (blocks.size() < 100 || signs.curve != TransferCurve::linear) return;
  // Texture only adds to the spread, so the smoothest band of angles has the speckle alone.
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Speckle found{infinity, infinity};
  for (const auto& [low, high] : {std::pair{14, 20}, {20, 40}, {40, 70}}) {
    std::vector<double> contrasts, skews;
    for (const Spread& block : blocks)
      if (block.grazing_rad >= low * degree && block.grazing_rad < high * degree) {
        contrasts.push_back(block.sd / block.mean);
        // A block that happens to have no clipped sample has lost its tail.
        constexpr double tail = 4.0;  // standard deviations
        if (!signs.clips || block.mean + tail * block.sd < signs.full_scale)
          skews.push_back(block.skew);
      }
    constexpr std::size_t enough = 50;
    if (contrasts.size() < enough) continue;
    const double contrast = median(std::move(contrasts));
    if (contrast < found.contrast)
      found = {contrast, skews.size() < enough ? infinity : median(std::move(skews))};
  }
  if (!std::isfinite(found.contrast)) return;
  tell_root(found, signs);
  signs.looks = looks_of(found.contrast, signs.detector, signs.curve);
  signs.looks_from = {
      Confidence::measured,
      fmt::format("standard deviation over mean of a smooth bed: {:.2f}{}", found.contrast,
                  line.peak_detector ? ", and the file states that the largest is kept" : "")};
}

double spread_of(const std::vector<double>& values) {
  const double middle = median(values);
  std::vector<double> off;
  for (const double value : values) off.push_back(std::abs(value - middle));
  return 1.4826 * median(std::move(off));  // sd of a normal distribution
}

/// Share of full scale that the mean amplitude of each ping of a side has; 0 if it differs from
/// ping to ping. In pings that are scaled, one part makes up for another: the whole varies less
/// than parts that vary independently would make it. Clipping lowers the mean of a ping that was
/// scaled before, so the less clipped half counts.
void set_ping_mean(const RecordedLine& line, RecorderSigns& signs) {
  constexpr std::size_t parts = 8;
  struct Row {
    std::size_t clipped;
    double mean;
    std::array<double, parts> of_parts;
  };
  std::vector<Row> rows;
  const std::size_t begin = line.samples / 50;  // beyond the transmitted pulse
  for (const Side side : line.sides()) {
    for (std::size_t ping = 0; ping < line.pings.size(); ++ping) {
      const std::span<const float> row = line.row(side, ping).subspan(begin);
      Row& one = rows.emplace_back();
      for (std::size_t k = 0; k < row.size(); ++k) {
        one.clipped += signs.clips && row[k] >= signs.full_scale;
        one.of_parts[parts * k / row.size()] +=
            expanded(row[k] / signs.full_scale, signs) / static_cast<double>(row.size());
      }
      one.mean = std::accumulate(one.of_parts.begin(), one.of_parts.end(), 0.0);
    }
  }
  std::ranges::stable_sort(rows, {}, &Row::clipped);
  rows.resize((rows.size() + 1) / 2);
  std::vector<double> means;
  for (const Row& row : rows) means.push_back(row.mean);
  double variance = 0.0;
  for (std::size_t part = 0; part < parts; ++part) {
    std::vector<double> values;
    for (const Row& row : rows) values.push_back(row.of_parts[part]);
    variance += std::pow(spread_of(values), 2);
  }
  const double middle = median(means), spread = spread_of(means) / middle,
               by_parts = std::sqrt(variance) / middle;
  constexpr double alike = 0.02, less = 0.5;
  if (middle > 0.0 && spread < alike && spread < less * by_parts) signs.ping_mean = middle;
  signs.ping_mean_from = {
      Confidence::measured,
      fmt::format("the pings' means differ by {:.1f} %; if parts of them varied independently, by "
                  "{:.1f} %",
                  100.0 * spread, 100.0 * by_parts)};
}

/// The level of the water column; and the length of the transmitted pulse, from the range at which
/// its leakage is no longer 4 times the column's amplitude.
void set_column(const RecordedLine& line, RecorderSigns& signs) {
  constexpr double over_column = 4.0;
  std::vector<double> lengths_m, columns;
  for (const Side side : line.sides()) {
    const std::vector<std::size_t> bed = bed_edge(line, side);
    for (std::size_t ping = 0; ping < line.pings.size(); ++ping) {
      if (bed[ping] < 24 || bed[ping] >= line.samples) continue;
      const std::span<const float> row = line.row(side, ping),
                                   column = water_column(line, side, ping, bed[ping]);
      if (column.empty()) continue;
      columns.push_back(median({column.begin(), column.end()}));
      const double threshold = over_column * columns.back();
      std::size_t k = 0;
      while (k < bed[ping] / 3 && row[k] > threshold) ++k;
      lengths_m.push_back(line.sample_range_m(ping, k));
    }
  }
  const double floor = median(std::move(columns)) / signs.full_scale;
  signs.burst_m = median(std::move(lengths_m)) / leakage_lengths(scatter::amplitude_to_db(std::max(
                                                     expanded(over_column * floor, signs), 1e-9)));
  // A Rayleigh amplitude's median is sqrt(ln 2) of its rms.
  signs.column_from = {Confidence::measured, "level of the water column"};
  if (floor > 0.0) {
    signs.column_db = scatter::amplitude_to_db(expanded(floor, signs) / std::sqrt(std::log(2.0)));
  } else if (floor == 0.0) {
    // Rayleigh amplitudes of this rms hardly ever reach half a step.
    const double half_step = 0.5 / (std::ldexp(1.0, signs.bits) - 1.0);
    signs.column_db = scatter::amplitude_to_db(expanded(half_step, signs)) - 20.0;
    signs.column_from = {Confidence::assumed,
                         "the water column is below the digitiser's first step"};
  } else {
    signs.column_from = {Confidence::assumed, "no water column"};
  }
  signs.burst_from = {Confidence::measured, "bright samples before the water column"};
}

}  // namespace

Speckle speckle_of(Detector detector, int looks, TransferCurve curve) {
  const bool root = curve == TransferCurve::square_root;
  if (detector == Detector::mean) {
    // A Rayleigh amplitude's; a mean of n has 1 / n of the variance and of the skewness squared.
    constexpr double pi = std::numbers::pi;
    const double number = std::sqrt(static_cast<double>(looks)),
                 contrast = std::sqrt(4.0 / pi - 1.0) / number,
                 skew = 2.0 * std::sqrt(pi) * (pi - 3.0) / std::pow(4.0 - pi, 1.5) / number;
    if (!root) return {contrast, skew};
    // The series of the root about the mean; its last term is such that one look is exact.
    return {0.5 * contrast * (1.0 + 0.268 * contrast * contrast), skew - 1.5 * contrast};
  }
  // The largest of n exponential intensities has the distribution (1 - exp(-I))^n.
  double mean = 0.0, squares = 0.0, cubes = 0.0;
  constexpr int steps = 20000;
  for (int i = 0; i < steps; ++i) {
    const double intensity = -std::log(1.0 - std::pow((i + 0.5) / steps, 1.0 / looks)),
                 value = std::pow(intensity, root ? 0.25 : 0.5);
    mean += value / steps;
    squares += value * value / steps;
    cubes += value * value * value / steps;
  }
  const double variance = squares - mean * mean;
  return {std::sqrt(variance) / mean,
          (cubes - mean * (3.0 * variance + mean * mean)) / std::pow(variance, 1.5)};
}

double expanded(double share, const RecorderSigns& recorder) {
  if (recorder.curve == TransferCurve::linear) return share;
  if (recorder.curve == TransferCurve::square_root) return share * share;
  return share > 0.0 ? scatter::amplitude_from_db((share - 1.0) * recorder.curve_range_db) : 0.0;
}

std::span<const float> water_column(const RecordedLine& line, Side side, std::size_t ping,
                                    std::size_t bed) {
  const std::size_t begin = std::max(bed / 3, line.pings[ping].unrecorded);
  return line.row(side, ping).subspan(begin, std::max(begin, bed * 9 / 10) - begin);
}

RecorderSigns recorder_signs(const RecordedLine& line) {
  RecorderSigns signs;
  set_full_scale(line, signs);
  const std::vector<Spread> blocks = spreads(line, signs.clips ? signs.full_scale : 1e30);
  set_curve(blocks, signs);
  set_looks(line, blocks, signs);
  set_ping_mean(line, signs);
  set_column(line, signs);
  return signs;
}

}  // namespace ensonify::engine
