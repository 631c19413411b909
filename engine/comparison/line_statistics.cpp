#include <ensonify/engine/comparison/line_statistics.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/base/quantile.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/engine/comparison/bed_drift.h>
#include <ensonify/engine/comparison/tone_change.h>
#include <ensonify/engine/recording/some_pings.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t fewest = 20;               // least blocks or samples for a value
constexpr double normal_median_square = 0.4549;  // for a normal distribution of variance 1

double median_of_enough(std::vector<double> values) {
  return values.size() < fewest ? unknown : median(std::move(values));
}

double share_of_enough(double some, std::size_t all) {
  return all < fewest ? unknown : some / static_cast<double>(all);
}

/// The sum of samples for a mean; the mean of too few samples is unknown.
struct Mean {
  double sum = 0.0;
  std::size_t count = 0;
  void add(double value) {
    sum += value;
    ++count;
  }
  double value() const { return share_of_enough(sum, count); }
};

/// The statistics of a block of the bed, whose samples are not all equal.
struct Block {
  double grazing_rad, mean, variance, skew, kurtosis;
  std::size_t bright;  ///< number of samples above 4 times the mean
  std::array<double, 4> range_correlation;
  std::array<double, 3> track_correlation;
};
constexpr std::array<std::size_t, 4> range_lags{1, 2, 4, 8};
constexpr std::array<std::size_t, 3> track_lags{1, 2, 4};

/// The correlation, about the mean of a block, of samples that are `pings` pings and `samples`
/// samples apart. The block begins at (ping, sample).
double correlation(const RecordedLine& line, Side side, std::size_t ping, std::size_t sample,
                   const Block& block, std::size_t pings, std::size_t samples) {
  double sum = 0.0;
  for (std::size_t i = 0; i + pings < block_pings; ++i)
    for (std::size_t k = 0; k + samples < block_samples; ++k)
      sum += (line.row(side, ping + i)[sample + k] - block.mean) *
             (line.row(side, ping + i + pings)[sample + k + samples] - block.mean);
  const auto pairs = static_cast<double>((block_pings - pings) * (block_samples - samples));
  return sum / (pairs * block.variance);
}

std::vector<Block> blocks_of(const RecordedLine& line, Side side, std::span<const std::size_t> bed,
                             std::size_t first, std::size_t end) {
  std::vector<Block> blocks;
  for (std::size_t ping = first; ping + block_pings <= end; ping += block_pings) {
    const std::size_t begin = std::ranges::max(bed.subspan(ping, block_pings));
    for (std::size_t sample = begin; sample + block_samples <= line.samples;
         sample += block_samples) {
      Block block{};
      std::vector<double> values;
      for (std::size_t i = 0; i < block_pings; ++i)
        for (std::size_t k = 0; k < block_samples; ++k)
          values.push_back(line.row(side, ping + i)[sample + k]);
      constexpr auto count = static_cast<double>(block_pings * block_samples);
      for (const double value : values) block.mean += value / count;
      double third = 0.0, fourth = 0.0;
      for (const double value : values) {
        const double off = value - block.mean, square = off * off;
        block.variance += square / count;
        third += square * off / count;
        fourth += square * square / count;
        block.bright += value > 4.0 * block.mean;
      }
      if (!(block.variance > 0.0)) continue;
      block.skew = third / std::pow(block.variance, 1.5);
      block.kurtosis = fourth / (block.variance * block.variance) - 3.0;
      const std::size_t middle = sample + block_samples / 2;
      block.grazing_rad =
          std::asin(std::min(static_cast<double>(begin) / static_cast<double>(middle), 1.0));
      for (std::size_t i = 0; i < range_lags.size(); ++i)
        block.range_correlation[i] = correlation(line, side, ping, sample, block, 0, range_lags[i]);
      for (std::size_t i = 0; i < track_lags.size(); ++i)
        block.track_correlation[i] = correlation(line, side, ping, sample, block, track_lags[i], 0);
      blocks.push_back(block);
    }
  }
  return blocks;
}

/// The collected values of both sides of some pings.
struct Samples {
  std::vector<Block> blocks;
  std::array<Mean, 18> power_by_grazing;  // in steps of 5 degrees
  std::array<Mean, 10> power_by_range;    // in tenths of the range
  std::array<Mean, 2> bed_power;          // by side
  std::size_t silent = 0, rows = 0;
  std::vector<double> column;     // amplitudes of the water column
  std::size_t column_bright = 0;  // number of these above 3 times the median of their row
  std::vector<double> first_m;    // range of the first return, for each row
  std::vector<double> wander_m;   // |first_m - its mean over 21 neighbouring pings|
  std::vector<double> overshoot_db;
  std::vector<double> row_brightness;            // |mean of the bed / that of 21 pings - 1|
  std::array<std::optional<double>, 2> drift_m;  // bed_drift_m(), by side
  std::array<std::vector<double>, tone_lags.size()> tone_changes_db2;
  std::size_t clipped = 0, all = 0;
};

/// Calls take(value, mean) for each value that has 10 values before and 10 values behind it; `mean`
/// is the mean of these 21 values.
template <class F>
void over_neighbours(const std::vector<double>& values, F&& take) {
  constexpr std::size_t reach = 10;
  for (std::size_t i = reach; i + reach < values.size(); ++i) {
    double mean = 0.0;
    for (std::size_t k = i - reach; k <= i + reach; ++k) mean += values[k] / (2.0 * reach + 1.0);
    take(values[i], mean);
  }
}

void add_side(const LineWithBed& line, Side side, std::size_t first, std::size_t end,
              float full_scale, Samples& to) {
  const std::vector<std::size_t>& bed = line.bed(side).first_sample;
  const std::vector<Block> blocks = blocks_of(line, side, bed, first, end);
  to.blocks.insert(to.blocks.end(), blocks.begin(), blocks.end());
  to.drift_m[static_cast<std::size_t>(side)] = bed_drift_m(line, side, bed, first, end);
  add_tone_changes(line, side, bed, first, end, to.tone_changes_db2);
  std::vector<double> first_m, brightness;
  for (std::size_t ping = first; ping < end; ++ping) {
    const std::span<const float> row = line.row(side, ping);
    const std::size_t begin = bed[ping];
    ++to.rows;
    if (begin >= line.samples) {
      ++to.silent;
      continue;
    }
    double sum = 0.0;
    for (std::size_t k = begin; k < line.samples; ++k) {
      const double power = double(row[k]) * row[k];
      const double grazing =
          std::asin(static_cast<double>(begin) / static_cast<double>(std::max(k, std::size_t{1})));
      to.power_by_grazing[std::min<std::size_t>(static_cast<std::size_t>(grazing / degree / 5.0),
                                                17)]
          .add(power);
      to.power_by_range[10 * k / line.samples].add(power);
      to.bed_power[static_cast<std::size_t>(side)].add(power);
      to.clipped += row[k] >= full_scale;
      ++to.all;
      sum += row[k];
    }
    brightness.push_back(sum / static_cast<double>(line.samples - begin));
    // The water column, without the transmit leakage and without the samples just before the bed.
    const std::size_t from = std::max(begin / 3, line.pings[ping].unrecorded);
    const std::size_t until = begin - std::min(begin, begin / 10 + 3);
    if (from < until) {
      const std::vector<double> column(row.begin() + static_cast<std::ptrdiff_t>(from),
                                       row.begin() + static_cast<std::ptrdiff_t>(until));
      const double middle = median(column);
      to.column_bright += static_cast<std::size_t>(
          std::ranges::count_if(column, [&](double value) { return value > 3.0 * middle; }));
      to.column.insert(to.column.end(), column.begin(), column.end());
    }
    const double sample_m = line.pings[ping].range_m / static_cast<double>(line.samples);
    first_m.push_back(static_cast<double>(begin) * sample_m);
    if (begin + begin / 2 + 8 < line.samples) {
      double near = 0.0, far = 0.0;
      for (std::size_t k = 0; k < 8; ++k) {
        near = std::max(near, double(row[begin + k]));
        far += row[begin + begin / 2 + k] / 8.0;
      }
      if (near > 0.0 && far > 0.0) to.overshoot_db.push_back(scatter::amplitude_to_db(near / far));
    }
  }
  to.first_m.insert(to.first_m.end(), first_m.begin(), first_m.end());
  over_neighbours(first_m, [&](double value, double mean) {
    if (value > 0.0) to.wander_m.push_back(std::abs(value - mean));
  });
  over_neighbours(brightness, [&](double value, double mean) {
    if (mean > 0.0) to.row_brightness.push_back(std::abs(value / mean - 1.0));
  });
}

/// The median of number(block) over the blocks with a grazing angle in [low_deg, high_deg).
template <class F>
double of_blocks(const Samples& samples, double low_deg, double high_deg, F&& number) {
  std::vector<double> values;
  for (const Block& block : samples.blocks)
    if (block.grazing_rad >= low_deg * degree && block.grazing_rad < high_deg * degree)
      values.push_back(number(block));
  return median_of_enough(std::move(values));
}

}  // namespace

std::vector<LineStatistic> line_statistics(const LineWithBed& line, std::size_t first,
                                           std::size_t end,
                                           const std::function<void()>& stop_check) {
  Samples samples;
  float full_scale = 0.0f;
  for (const Side side : line.sides())
    for (const float value : line.side(side)) full_scale = std::max(full_scale, value);
  for (const Side side : line.sides()) {
    if (stop_check) stop_check();
    add_side(line, side, first, end, full_scale, samples);
  }

  std::vector<LineStatistic> all;
  const auto add = [&](std::string name, double value, CurvePart part = {}) {
    all.push_back({std::move(name), value, part});
  };
  const auto add_of_path = [&](std::string name, double value) {
    all.push_back({std::move(name), value, {}, true});
  };
  const auto& [port, starboard] = samples.bed_power;
  const double bed_power = Mean{port.sum + starboard.sum, port.count + starboard.count}.value();
  const auto level = [&](const Mean& power) { return scatter::to_db(power.value() / bed_power); };
  for (int low = 5; low < 80; low += 5)
    add(fmt::format("level_at_{}_to_{}_deg_db", low, low + 5),
        level(samples.power_by_grazing[static_cast<std::size_t>(low / 5)]),
        {StatisticCurve::level_over_grazing, low, low + 5});
  for (int low = 0; low < 100; low += 10)
    add(fmt::format("level_at_{}_to_{}_percent_of_range_db", low, low + 10),
        level(samples.power_by_range[static_cast<std::size_t>(low / 10)]),
        {StatisticCurve::level_over_range, low, low + 10});
  for (const auto& band : {std::pair{8, 14}, {14, 20}, {20, 40}, {40, 70}}) {
    const int low = band.first, high = band.second;
    const auto name = [&](std::string_view what) {
      return fmt::format("{}_at_{}_to_{}_deg", what, low, high);
    };
    const auto number = [&](auto value) { return of_blocks(samples, low, high, value); };
    add(name("contrast"), number([](const Block& b) { return std::sqrt(b.variance) / b.mean; }),
        {StatisticCurve::contrast_over_grazing, low, high});
    add(name("skew"), number([](const Block& b) { return b.skew; }));
    add(name("kurtosis"), number([](const Block& b) { return b.kurtosis; }));
    double bright = 0.0, blocks = 0.0;
    for (const Block& block : samples.blocks)
      if (block.grazing_rad >= low * degree && block.grazing_rad < high * degree) {
        bright += static_cast<double>(block.bright);
        blocks += 1.0;
      }
    add(name("bright_per_10000"),
        blocks < fewest ? unknown : 1e4 * bright / (blocks * block_pings * block_samples));
  }
  for (std::size_t i = 0; i < range_lags.size(); ++i)
    add(fmt::format("range_correlation_{}", range_lags[i]),
        of_blocks(samples, 8, 70, [i](const Block& b) { return b.range_correlation[i]; }));
  for (std::size_t i = 0; i < track_lags.size(); ++i)
    add(fmt::format("track_correlation_{}", track_lags[i]),
        of_blocks(samples, 8, 70, [i](const Block& b) { return b.track_correlation[i]; }));
  for (std::size_t i = 0; i < tone_lags.size(); ++i)
    add(fmt::format("tone_change_over_{}_pings_db", tone_lags[i]),
        std::sqrt(median_of_enough(samples.tone_changes_db2[i]) / normal_median_square));
  add_of_path("sideways_drift_m",
              sideways_drift_m(samples.drift_m[0], samples.drift_m[1]).value_or(unknown));
  // 1.4826 times the median deviation is the standard deviation of a normal distribution.
  add("ping_brightness", 1.4826 * median_of_enough(samples.row_brightness));
  const double column = median_of_enough(samples.column);
  add("column_over_bed_db", scatter::amplitude_to_db(column / std::sqrt(bed_power)));
  add("column_over_bed", column / std::sqrt(bed_power));
  add("column_bright_per_10000",
      share_of_enough(1e4 * static_cast<double>(samples.column_bright), samples.column.size()));
  add_of_path("first_return_m", median_of_enough(samples.first_m));
  add_of_path("first_return_wander_m", 1.4826 * median_of_enough(samples.wander_m));
  add("first_return_overshoot_db", median_of_enough(samples.overshoot_db));
  add("clipped_share", share_of_enough(static_cast<double>(samples.clipped), samples.all));
  add("port_over_starboard_db", scatter::to_db(port.value() / starboard.value()));
  add("silent_share", share_of_enough(static_cast<double>(samples.silent), samples.rows));
  return all;
}

double ComparedStatistic::ratio() const {
  constexpr double rounding = 1e-5;  // of a file: JSF has sample intervals in whole nanoseconds
  const double difference = std::abs(b - a);
  return difference <= rounding * std::abs(a) ? 0.0 : difference / spread;
}

std::array<std::vector<std::size_t>, 2> halves_at_equal_altitude(const LineWithBed& line) {
  constexpr std::size_t block = 32;
  constexpr double alike = 0.05;
  const std::size_t pings = line.pings.size(),
                    blocks = 2 * std::max<std::size_t>(1, pings / (2 * block));
  const auto first_of = [&](std::size_t part, std::size_t parts) { return part * pings / parts; };
  const auto bed_in = [&](std::size_t part, std::size_t parts) {
    std::vector<double> samples;
    for (const Side side : line.sides())
      for (std::size_t i = first_of(part, parts); i < first_of(part + 1, parts); ++i)
        if (const std::size_t bed = line.bed(side).first_sample[i]; bed < line.samples)
          samples.push_back(static_cast<double>(bed));
    return median(std::move(samples));
  };
  std::vector<std::size_t> order(blocks);
  std::iota(order.begin(), order.end(), 0);
  if (const double early = bed_in(0, 2), late = bed_in(1, 2);
      std::abs(early - late) > alike * std::max(early, late)) {
    std::vector<double> altitudes;
    for (std::size_t part = 0; part < blocks; ++part) altitudes.push_back(bed_in(part, blocks));
    std::ranges::stable_sort(order, {}, [&](std::size_t part) { return altitudes[part]; });
    std::vector<std::size_t> first, second;
    for (std::size_t i = 0; i < blocks; i += 2) {
      first.push_back(std::min(order[i], order[i + 1]));
      second.push_back(std::max(order[i], order[i + 1]));
    }
    std::ranges::sort(first);
    std::ranges::sort(second);
    std::ranges::copy(first, order.begin());
    std::ranges::copy(second, order.begin() + static_cast<std::ptrdiff_t>(blocks / 2));
  }
  std::array<std::vector<std::size_t>, 2> halves;
  for (std::size_t i = 0; i < blocks; ++i)
    for (std::size_t ping = first_of(order[i], blocks); ping < first_of(order[i] + 1, blocks);
         ++ping)
      halves[2 * i / blocks].push_back(ping);
  return halves;
}

std::vector<ComparedStatistic> compare_lines(const LineWithBed& a, const LineWithBed& b,
                                             const std::function<void()>& stop_check) {
  const std::size_t pings = a.pings.size(), half = pings / 2;
  const auto statistics = [&](const LineWithBed& line, std::size_t begin, std::size_t end) {
    return line_statistics(line, begin, end, stop_check);
  };
  using Statistics = std::vector<LineStatistic>;
  const Statistics of_a = statistics(a, 0, pings), first = statistics(a, 0, half),
                   second = statistics(a, half, pings), of_b = statistics(b, 0, b.pings.size());
  const std::array<std::vector<std::size_t>, 2> equal = halves_at_equal_altitude(a);
  const bool as_they_are = equal[0].empty() || equal[0].back() < equal[1].front();
  const auto at_equal = [&](std::size_t which) {
    const LineWithBed part(some_pings(a, equal[which]));
    return statistics(part, 0, part.pings.size());
  };
  const Statistics one = as_they_are ? first : at_equal(0),
                   other = as_they_are ? second : at_equal(1);
  std::vector<ComparedStatistic> all;
  for (std::size_t i = 0; i < of_a.size(); ++i)
    all.push_back({.name = of_a[i].name,
                   .a = of_a[i].value,
                   .b = of_b[i].value,
                   .spread = of_a[i].of_path ? std::abs(first[i].value - second[i].value)
                                             : std::abs(one[i].value - other[i].value),
                   .part = of_a[i].part});
  return all;
}

Likeness likeness(std::span<const ComparedStatistic> statistics) {
  const auto rms = [&](StatisticCurve curve, auto&& difference_db) {
    double squares = 0.0, number = 0.0;
    for (const ComparedStatistic& one : statistics) {
      if (one.part.curve != curve) continue;
      const double off_db = difference_db(one);
      if (!std::isfinite(off_db)) continue;
      squares += off_db * off_db;
      number += 1.0;
    }
    return std::sqrt(squares / number);
  };
  const auto levels = [](const ComparedStatistic& one) { return one.b - one.a; };
  Likeness found;
  found.level_over_grazing_db = rms(StatisticCurve::level_over_grazing, levels);
  found.level_over_range_db = rms(StatisticCurve::level_over_range, levels);
  found.contrast_db = rms(StatisticCurve::contrast_over_grazing, [](const ComparedStatistic& one) {
    return scatter::amplitude_to_db(one.b / one.a);
  });
  for (const ComparedStatistic& one : statistics) {
    const double ratio = one.ratio();
    if (std::isnan(ratio)) continue;
    ++found.known;
    found.within += ratio <= 1.0;
  }
  return found;
}

std::string Likeness::decibels() const {
  std::string text;
  for (const auto& [what, off_db] : {std::pair{"the level over the angle", level_over_grazing_db},
                                     {"the level over the range", level_over_range_db},
                                     {"the contrast", contrast_db}})
    if (std::isfinite(off_db))
      text += fmt::format("{}{} is {:.1f} dB off", text.empty() ? "" : ", ", what, off_db);
  return text.empty() ? "no level is known of both" : text + " (root mean square)";
}

}  // namespace ensonify::engine
