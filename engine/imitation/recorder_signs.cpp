#include <ensonify/engine/imitation/recorder_signs.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include <fmt/format.h>

#include <ensonify/engine/base/quantile.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/engine/comparison/find_bed.h>
#include <ensonify/engine/comparison/tone_change.h>
#include <ensonify/engine/imitation/vehicle_path.h>
#include <ensonify/engine/sonar/reception/transmit_leakage.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

void set_full_scale(const RecordedLine& line, RecorderSigns& signs) {
  float largest = 0.0f;
  std::size_t samples = 0;
  for (const Side side : {Side::port, Side::starboard})
    for (const float value : line.side(side)) largest = std::max(largest, value);
  std::size_t at_largest = 0;
  bool whole = true;
  for (const Side side : {Side::port, Side::starboard})
    for (const float value : line.side(side)) {
      at_largest += value == largest;
      whole = whole && value == std::floor(value);
      ++samples;
    }
  signs.clips =
      at_largest >= 20 && 1e5 * static_cast<double>(at_largest) > static_cast<double>(samples);
  signs.full_scale = largest;
  constexpr int max_bits = 24;  // most bits of a scene; the samples are floats with 24 bits
  signs.bits = max_bits;
  const int bits =
      static_cast<int>(std::bit_width(static_cast<unsigned>(std::min(largest, 16777216.0f))));
  if (whole && bits >= 1 && bits <= max_bits) {
    signs.bits = bits;
    if (!signs.clips) signs.full_scale = static_cast<double>((1u << bits) - 1u);
    signs.bits_from = {Confidence::measured,
                       fmt::format("the largest sample is {:.0f}{}", largest,
                                   signs.clips ? ", and many are as large: it clips there" : "")};
  } else {
    signs.bits_from = {Confidence::assumed,
                       fmt::format("its samples are no whole numbers of up to {} bits", max_bits)};
  }
}

/// The statistics of those blocks of the bed that have no clipped sample.
struct Spread {
  double mean, sd, skew, grazing_rad;
};
std::vector<Spread> spreads(const LineWithBed& line, double full_scale) {
  std::vector<Spread> all;
  for (const Side side : line.sides()) {
    const std::vector<std::size_t>& bed = line.bed(side).edge;
    for (std::size_t ping = 0; ping + block_pings <= line.pings.size(); ping += block_pings) {
      const std::size_t begin = std::ranges::max(std::span(bed).subspan(ping, block_pings));
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
               std::asin(nearest_bed(line, ping, begin) /
                         (static_cast<double>(k) + 0.5 * block_samples))});
      }
    }
  }
  return all;
}

/// The blocks of the band of grazing angles in which samples spread least: relief, shadows and
/// texture can only increase the spread by speckle.
std::vector<Spread> smoothest(const std::vector<Spread>& blocks,
                              double (*spread_of)(const Spread&)) {
  std::vector<Spread> found;
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [low, high] : {std::pair{14, 20}, {20, 40}, {40, 70}}) {
    std::vector<Spread> band;
    std::vector<double> values;
    for (const Spread& block : blocks)
      if (block.grazing_rad >= low * degree && block.grazing_rad < high * degree) {
        band.push_back(block);
        values.push_back(spread_of(block));
      }
    constexpr std::size_t enough = 50;
    if (band.size() < enough) continue;
    if (const double spread = median(std::move(values)); spread < least) {
      least = spread;
      found = std::move(band);
    }
  }
  return found;
}

/// The mean spread and skewness of samples whose spread does not depend on their mean. Blocks whose
/// spread is far from the median are left out, since most of them have relief or an object. The
/// moments of the others are averaged, because the skewness of single blocks is biased.
struct LogSpeckle {
  double sd, skew;
};
LogSpeckle log_speckle(const std::vector<Spread>& blocks) {
  std::vector<double> sds;
  for (const Spread& block : blocks) sds.push_back(block.sd);
  const double usual = median(std::move(sds));
  constexpr double far_off = 0.3;
  double number = 0.0, squares = 0.0, cubes = 0.0;
  for (const Spread& block : blocks) {
    if (!(std::abs(block.sd / usual - 1.0) < far_off)) continue;
    number += 1.0;
    squares += block.sd * block.sd;
    cubes += block.skew * std::pow(block.sd, 3);
  }
  const double sd = std::sqrt(squares / number);
  return {sd, cubes / number / std::pow(sd, 3)};
}

constexpr int most_looks = 16;

/// The number of looks whose decibels have this skewness.
int looks_of_skew(double skew, Detector detector) {
  int best = 1;
  const auto off = [&](int looks) {
    return std::abs(speckle_of(detector, looks, TransferCurve::logarithmic).skew - skew);
  };
  for (int looks = 2; looks <= most_looks; ++looks)
    if (off(looks) < off(best)) best = looks;
  return best;
}

/// A recorder is logarithmic if the spread of its samples stays the same while their mean grows, or
/// if their skewness is too negative for their contrast. The ratio of skewness to contrast is 1.2
/// for Rayleigh amplitudes and -0.6 for their square root, for any number of looks. For their
/// decibels it is about -5 to -15. Relief, shadows and texture only increase the spread, so the
/// blocks with the smallest spread are used.
void set_curve(std::vector<Spread> blocks, RecorderSigns& signs) {
  constexpr double quietest = 0.2, least_change = 0.1, logarithmic = -1.5, alike = 0.4,
                   to_the_low_side = -0.1;
  signs.curve_from = {Confidence::assumed, "too few unclipped samples of the bed"};
  if (blocks.size() < 100) return;
  std::ranges::sort(blocks, {}, &Spread::mean);
  // Compare the fifth of the blocks with the lowest means and the fifth with the highest.
  const std::size_t fifth = blocks.size() / 5;
  std::vector<double> at_low, at_high, skews, contrasts;
  for (std::size_t i = 0; i < fifth; ++i) {
    at_low.push_back(blocks[i].sd);
    const Spread& high = blocks[blocks.size() - 1 - i];
    at_high.push_back(high.sd);
    skews.push_back(high.skew);
    contrasts.push_back(high.sd / high.mean);
  }
  const double mean_ratio =
      std::log(blocks[blocks.size() - fifth / 2].mean / blocks[fifth / 2].mean);
  const double growth =
      std::log(quantile(std::move(at_high), quietest) / quantile(std::move(at_low), quietest)) /
      mean_ratio;
  const double skew = median(std::move(skews)), contrast = median(std::move(contrasts));
  const bool changes = mean_ratio > least_change;
  const std::string speckle =
      fmt::format("a contrast of {:.2f} and a skew of {:.1f}", contrast, skew);
  signs.curve_from = {
      Confidence::measured,
      changes
          ? fmt::format("over the bed the spread grows as mean^{:.1f}; it has {}", growth, speckle)
          : "the speckle has " + speckle};
  if (skew < logarithmic * contrast || (changes && growth < alike && skew < to_the_low_side))
    signs.curve = TransferCurve::logarithmic;
}

/// The number of looks whose speckle has nearest to this contrast. Texture and relief increase the
/// contrast. If more looks were chosen, texture might be unable to make up for them.
int looks_of(double contrast, Detector detector, TransferCurve curve) {
  const auto speckle = [&](int looks) { return speckle_of(detector, looks, curve).contrast; };
  int looks = 1;
  while (looks < most_looks && contrast < 0.5 * (speckle(looks) + speckle(looks + 1))) ++looks;
  return looks;
}

/// Distinguishes a square-root curve from a linear one by the contrast and skewness of the speckle.
/// With a square root both are small. With several looks, a linear curve can have such a small
/// contrast, too, but then the skewness is clearly positive.
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

/// For a logarithmic recorder: finds the looks by the skewness, which does not depend on the range
/// of the curve, and then the range of the curve by the spread.
void set_logarithmic_looks(const std::vector<Spread>& smooth, RecorderSigns& signs) {
  const LogSpeckle found = log_speckle(smooth);
  signs.looks = looks_of_skew(found.skew, signs.detector);
  const double sd_db = speckle_of(signs.detector, signs.looks, TransferCurve::logarithmic).contrast;
  constexpr double least_db = 20.0, most_db = 200.0;
  signs.curve_range_db = std::clamp(sd_db * signs.full_scale / found.sd, least_db, most_db);
  signs.curve_range_from = within_limits({Confidence::measured, "contrast of a smooth bed"},
                                         signs.curve_range_db, least_db, most_db);
  signs.looks_from =
      within_limits({Confidence::measured, fmt::format("skew of a smooth bed: {:.2f}", found.skew)},
                    signs.looks, 0, most_looks);
}

void set_looks(const RecordedLine& line, const std::vector<Spread>& blocks, RecorderSigns& signs) {
  signs.detector = line.peak_detector ? Detector::peak : Detector::mean;
  signs.looks_from = {Confidence::assumed, "too few unclipped samples of the bed"};
  if (blocks.size() < 100) return;
  if (signs.curve == TransferCurve::logarithmic) {
    const std::vector<Spread> smooth =
        smoothest(blocks, [](const Spread& block) { return block.sd; });
    set_logarithmic_looks(smooth.empty() ? blocks : smooth, signs);
    return;
  }
  const std::vector<Spread> smooth =
      smoothest(blocks, [](const Spread& block) { return block.sd / block.mean; });
  if (smooth.empty()) return;
  std::vector<double> contrasts, skews;
  for (const Spread& block : smooth) {
    contrasts.push_back(block.sd / block.mean);
    // If the recorder clips, even a block without a clipped sample may lack its largest values.
    constexpr double tail = 4.0;  // in standard deviations
    if (!signs.clips || block.mean + tail * block.sd < signs.full_scale)
      skews.push_back(block.skew);
  }
  constexpr std::size_t enough = 50;
  const Speckle found{median(std::move(contrasts)), skews.size() < enough
                                                        ? std::numeric_limits<double>::infinity()
                                                        : median(std::move(skews))};
  tell_root(found, signs);
  signs.looks = looks_of(found.contrast, signs.detector, signs.curve);
  signs.looks_from = within_limits(
      {Confidence::measured,
       fmt::format("standard deviation over mean of a smooth bed: {:.2f}{}", found.contrast,
                   line.peak_detector ? ", and the file states that the largest is kept" : "")},
      signs.looks, 0, most_looks);
}

/// Mean amplitudes of stretches of samples, in full scales: their median, their robust standard
/// deviation divided by the median, and the standard deviation that they would have if their parts
/// varied independently.
struct Stretches {
  double median = 0.0, spread = 0.0, by_parts = 0.0;
};
/// The means of stretches of `length` samples of each ping, from sample `begin` on. If a recorder
/// scales stretches to one mean, a bright part is compensated by other parts: the whole varies less
/// than if its parts varied independently. Clipping lowers the mean of a stretch that was scaled
/// before, so only the half of the stretches with less clipping counts.
Stretches stretches_of(const RecordedLine& line, const RecorderSigns& signs, std::size_t begin,
                       std::size_t length) {
  constexpr std::size_t parts = 8;
  struct Stretch {
    std::size_t clipped;
    double mean;
    std::array<double, parts> of_parts;
  };
  std::vector<Stretch> all;
  for (const Side side : line.sides())
    for (std::size_t ping = 0; ping < line.pings.size(); ++ping)
      for (std::size_t first = begin; first + length <= line.samples; first += length) {
        const std::span<const float> samples = line.row(side, ping).subspan(first, length);
        Stretch& one = all.emplace_back();
        for (std::size_t k = 0; k < length; ++k) {
          one.clipped += signs.clips && samples[k] >= signs.full_scale;
          one.of_parts[parts * k / length] +=
              expanded(samples[k] / signs.full_scale, signs) / static_cast<double>(length);
        }
        one.mean = std::accumulate(one.of_parts.begin(), one.of_parts.end(), 0.0);
      }
  std::ranges::stable_sort(all, {}, &Stretch::clipped);
  all.resize((all.size() + 1) / 2);
  std::vector<double> means;
  for (const Stretch& one : all) means.push_back(one.mean);
  double variance = 0.0;
  for (std::size_t part = 0; part < parts; ++part) {
    std::vector<double> values;
    for (const Stretch& one : all) values.push_back(one.of_parts[part]);
    variance += std::pow(robust_deviation(values), 2);
  }
  const double middle = median(means);
  return {middle, robust_deviation(means) / middle, std::sqrt(variance) / middle};
}

/// Finds the mean amplitude to which each ping of a side is scaled, as a share of full scale; 0 if
/// the means differ from ping to ping.
void set_ping_mean(const RecordedLine& line, RecorderSigns& signs) {
  const std::size_t begin = line.samples / 50;  // after the transmitted pulse
  const Stretches pings = stretches_of(line, signs, begin, line.samples - begin);
  constexpr double alike = 0.02, less = 0.5;
  if (pings.median > 0.0 && pings.spread < alike && pings.spread < less * pings.by_parts)
    signs.ping_mean = pings.median;
  signs.ping_mean_from = {
      Confidence::measured,
      fmt::format("the pings' means differ by {:.1f} %; if parts of them varied independently, by "
                  "{:.1f} %",
                  100.0 * pings.spread, 100.0 * pings.by_parts)};
}

/// Finds an automatic gain. It equalises the level over range: the mean over all pings, or the mean
/// of each ping over some distance. No bed and beam do this with any gain over range.
void set_automatic_gain(const RecordedLine& line, RecorderSigns& signs) {
  signs.even_ranges = ranges_are_even(line);
  if (signs.even_ranges) return;
  constexpr double alike = 0.05, less = 0.6;
  constexpr std::size_t shortest = 32;
  // From a quarter of the range on, where the samples are bed.
  for (std::size_t length = line.samples / 4; length >= shortest; length /= 2) {
    const Stretches found = stretches_of(line, signs, line.samples / 4, length);
    if (found.spread < alike && found.spread < less * found.by_parts) signs.even_samples = length;
  }
  if (signs.even_samples > 0) signs.ping_mean = 0.0;
}

/// Finds the level of the water column, and the length of the transmitted pulse: from the range
/// beyond which its leakage is less than 4 times the column's amplitude.
void set_column(const LineWithBed& line, RecorderSigns& signs) {
  constexpr double over_column = 4.0;
  std::vector<double> lengths_m, columns, levels;
  float largest = 0.0f;
  for (const Side side : line.sides()) {
    const std::vector<std::size_t>& bed = line.bed(side).edge;
    for (std::size_t ping = 0; ping < line.pings.size(); ++ping) {
      if (bed[ping] < 24 || bed[ping] >= line.samples) continue;
      const std::span<const float> row = line.row(side, ping);
      std::vector<double> column;
      for (std::size_t k = column_begin(line.pings[ping], bed[ping]); k < bed[ping] * 9 / 10; ++k)
        column.push_back(row[k]);
      if (column.empty()) continue;
      columns.push_back(median(std::move(column)));
      const double threshold = over_column * columns.back();
      std::size_t k = 0;
      while (k < bed[ping] / 3 && row[k] > threshold) ++k;
      lengths_m.push_back(line.sample_range_m(ping, k));
      largest = std::max(largest, std::ranges::max(row));
      if (k > 0) levels.push_back(std::ranges::max(row.first(k)));
    }
  }
  if (columns.empty() || signs.even_ranges) {
    const char* why = columns.empty() ? "no water column"
                                      : "the recorder makes the water column as bright as the bed";
    signs.column_from = signs.burst_from = {Confidence::assumed, why};
    return;
  }
  const double floor = median(std::move(columns)) / signs.full_scale;
  signs.burst_m = median(std::move(lengths_m)) / leakage_lengths(scatter::amplitude_to_db(std::max(
                                                     expanded(over_column * floor, signs), 1e-9)));
  // The median of a Rayleigh amplitude is sqrt(ln 2) times its rms.
  signs.column_from = {Confidence::measured, "level of the water column"};
  if (floor > 0.0) {
    signs.column_db = scatter::amplitude_to_db(expanded(floor, signs) / std::sqrt(std::log(2.0)));
  } else {
    // Rayleigh amplitudes 20 dB below half a step hardly ever reach half a step.
    const double half_step = 0.5 / (std::ldexp(1.0, signs.bits) - 1.0);
    signs.column_db = scatter::amplitude_to_db(expanded(half_step, signs)) - 20.0;
    signs.column_from = {Confidence::assumed,
                         "the water column is below the digitiser's first step"};
  }
  signs.burst_from = {Confidence::measured, "bright samples before the water column"};
  // The leakage of a scene is at full scale. A weaker echo of hull or pulse is not leakage.
  constexpr double as_leakage = 0.5;  // share of the largest amplitude
  const double share = expanded(median(std::move(levels)) / signs.full_scale, signs) /
                       expanded(largest / signs.full_scale, signs);
  if (signs.burst_m > 0.0 && share < as_leakage) {
    signs.burst_m = 0.0;
    signs.burst_from.why += fmt::format(
        " are {:.0f} dB below the brightest, and a scene's leakage would be at full scale: left out",
        -scatter::amplitude_to_db(share));
  }
}

}  // namespace

std::size_t column_begin(const RecordedPing& ping, std::size_t bed) {
  return std::max(bed / 3, ping.unrecorded);
}

double expanded(double share, const RecorderSigns& recorder) {
  if (recorder.curve == TransferCurve::linear) return share;
  if (recorder.curve == TransferCurve::square_root) return share * share;
  return share > 0.0 ? scatter::amplitude_from_db((share - 1.0) * recorder.curve_range_db) : 0.0;
}

Speckle speckle_of(Detector detector, int looks, TransferCurve curve) {
  const bool root = curve == TransferCurve::square_root;
  const bool logarithmic = curve == TransferCurve::logarithmic;
  if (detector == Detector::mean) {
    // Contrast and skewness of a Rayleigh amplitude. The mean of n amplitudes has 1 / n of the
    // variance and of the squared skewness.
    constexpr double pi = std::numbers::pi;
    const double number = std::sqrt(static_cast<double>(looks)),
                 contrast = std::sqrt(4.0 / pi - 1.0) / number,
                 skew = 2.0 * std::sqrt(pi) * (pi - 3.0) / std::pow(4.0 - pi, 1.5) / number;
    // The series of the curve about the mean. Its last term is chosen so that one look is exact:
    // 5.57 dB (Ulaby and others, Microwave Remote Sensing, vol. 2, ch. 7) and the skewness of a
    // Gumbel distribution.
    if (logarithmic)
      return {20.0 / std::numbers::ln10 * contrast * (1.0 + 0.227 / looks),
              (skew - 3.0 * contrast) * (1.0 + 0.216 / looks)};
    if (!root) return {contrast, skew};
    return {0.5 * contrast * (1.0 + 0.268 * contrast * contrast), skew - 1.5 * contrast};
  }
  // The largest of n exponential intensities has the distribution (1 - exp(-I))^n.
  double mean = 0.0, squares = 0.0, cubes = 0.0;
  constexpr int steps = 20000;
  for (int i = 0; i < steps; ++i) {
    const double intensity = -std::log(1.0 - std::pow((i + 0.5) / steps, 1.0 / looks)),
                 value = logarithmic ? scatter::to_db(intensity)
                                     : std::pow(intensity, root ? 0.25 : 0.5);
    mean += value / steps;
    squares += value * value / steps;
    cubes += value * value * value / steps;
  }
  const double variance = squares - mean * mean,
               skew = (cubes - mean * (3.0 * variance + mean * mean)) / std::pow(variance, 1.5);
  return {logarithmic ? std::sqrt(variance) : std::sqrt(variance) / mean, skew};
}

RecorderSigns recorder_signs(const LineWithBed& line) {
  RecorderSigns signs;
  set_full_scale(line, signs);
  const std::vector<Spread> blocks = spreads(line, signs.clips ? signs.full_scale : 1e30);
  set_curve(blocks, signs);
  set_looks(line, blocks, signs);
  set_ping_mean(line, signs);
  set_automatic_gain(line, signs);
  set_column(line, signs);
  return signs;
}

}  // namespace ensonify::engine
