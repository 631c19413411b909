#include <ensonify/engine/comparison/find_bed.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <span>

#include <ensonify/engine/base/quantile.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t lasting = 8;  // successive samples that show a bed
// A bed that is darker than the usual bed by this factor is not distinguished from water.
constexpr double darkest_of_level = 3e-3;

/// Amplitudes as means over 5 pings and 5 samples.
class Smooth {
 public:
  Smooth(const RecordedLine& line, Side side) : line_(line), side_(side), row_(line.samples) {}

  /// The row of a ping; valid until the next call.
  std::span<const double> row(std::size_t ping) {
    const std::size_t begin = ping < 2 ? 0 : ping - 2, end = std::min(ping + 3, line_.pings.size());
    std::vector<double> sum(line_.samples + 4, 0.0);
    for (std::size_t i = begin; i < end; ++i) {
      const std::span<const float> values = line_.row(side_, i);
      for (std::size_t k = 0; k < line_.samples; ++k) sum[k + 2] += values[k];
    }
    const double scale = 1.0 / (5.0 * static_cast<double>(end - begin));
    for (std::size_t k = 0; k < line_.samples; ++k)
      row_[k] = scale * (sum[k] + sum[k + 1] + sum[k + 2] + sum[k + 3] + sum[k + 4]);
    return row_;
  }

 private:
  const RecordedLine& line_;
  Side side_;
  std::vector<double> row_;
};

double level_below(std::span<const double> row, double share) {
  constexpr std::size_t fewest = 10;
  return row.size() < fewest ? std::numeric_limits<double>::quiet_NaN()
                             : quantile({row.begin(), row.end()}, share);
}

/// By sample: the growth of the water column with range, as a time-varied gain amplifies its noise.
using Growth = std::vector<double>;

/// The power at a sample from the side lobes of the echoes behind it, for a sweep without a window.
/// A matched filter has the side lobes sinc(x), whose mean square at x range cells is 1 / (2 pi^2
/// x^2); the echoes of different cells add by power. `cell` is a range cell in samples. Echoes
/// within a cell, or within the width of the means, are not counted.
double side_lobes_at(std::span<const double> row, std::size_t sample, double cell) {
  constexpr std::size_t blur = 5, reach = 200;  // samples; echoes beyond the reach add little
  double power = 0.0;
  const std::size_t end = std::min(sample + reach, row.size());
  for (std::size_t k = sample + std::max(blur, static_cast<std::size_t>(cell)); k < end; ++k) {
    const auto apart = static_cast<double>(k - sample);
    power += row[k] * row[k] / (apart * apart);
  }
  return power * cell / (2.0 * std::numbers::pi * std::numbers::pi);
}

/// The range cell of the line's pulse in samples, from the far half of the rows. For a sweep
/// without a window it is the sum over all lags of the correlation of speckle intensities;
/// amplitudes have nearly this correlation. Small correlations are from the bed and not used.
double range_cell(const RecordedLine& line, Side side) {
  constexpr std::size_t block = 32, lags = 9, rows = 400;
  constexpr double small = 0.1;
  std::array<double, lags> products{};
  for (std::size_t ping = 0; ping < line.pings.size(); ping += line.pings.size() / rows + 1) {
    const std::span<const float> row = line.row(side, ping);
    for (std::size_t first = row.size() / 2; first + block <= row.size(); first += block) {
      const std::span<const float> values = row.subspan(first, block);
      const double mean = std::accumulate(values.begin(), values.end(), 0.0) / double{block};
      for (std::size_t lag = 0; lag < lags; ++lag)
        for (std::size_t k = 0; k + lag < block; ++k)
          products[lag] += (values[k] - mean) * (values[k + lag] - mean) / double(block - lag);
    }
  }
  double cell = 1.0;
  for (std::size_t lag = 1; lag < lags && products[lag] > small * products[0]; ++lag)
    cell += 2.0 * products[lag] / products[0];
  return cell;
}

/// Properties of the water column of a line.
struct Water {
  Growth growth;              ///< empty: not known yet
  std::size_t recorded_from;  ///< the first sample that is recorded in all pings
  double cell;                ///< range_cell()
};

/// The sample at which the bed begins to rise above the water column. `first` is a later sample
/// that is clearly bed, and a sample below `lowest` is not bed. A beam that looks away from the
/// nadir receives the nearest bed only weakly, so the samples rise slowly. The side lobes of a
/// sweep before a steep rise look alike and are left out.
std::size_t foot_of(std::span<const double> row, const Water& water, std::size_t first,
                    double lowest) {
  // The bed may fill most of the samples before `first`, so the darkest fifth is taken as water.
  // The mean of 25 Rayleigh amplitudes has a standard deviation of 0.1 times its mean, so
  // over_water is about four standard deviations above the mean.
  constexpr double water_share = 0.2, over_water = 1.5;
  std::vector<double> before;
  for (std::size_t k = std::max(first / 4, water.recorded_from); k < first; ++k)
    before.push_back(row[k] / water.growth[k]);
  const double level = level_below(before, water_share);
  if (std::isnan(level)) return first;
  const auto over_noise = [&](std::size_t k) {
    return row[k] > std::max(over_water * level * water.growth[k], lowest);
  };
  const auto is_side_lobe = [&](std::size_t k, double noise) {
    return std::pow(row[k] / over_water, 2) < noise * noise + side_lobes_at(row, k, water.cell);
  };
  while (first + 1 < row.size() && is_side_lobe(first, 0.0)) ++first;
  std::size_t foot = first;
  while (foot > water.recorded_from && over_noise(foot - 1) &&
         !is_side_lobe(foot - 1, level * water.growth[foot - 1]))
    --foot;
  return foot + bed_found_early < first ? foot : first;  // the means alone make a shorter rise
}

/// A place where the bed may begin.
struct Rise {
  std::size_t sample = 0;
  double echo_before = 0.0;  ///< share of the samples before the rise that are as bright as the bed
};

/// The first 8 rises of a ping, from near to far; later rises are texture of the bed. Unset if the
/// ping is silent. If the growth is not known, a rise is the first sample that is clearly bed.
std::optional<std::vector<Rise>> rises_of(std::span<const double> row, const Water& known) {
  const std::size_t recorded_from = known.recorded_from;
  // The darkest tenth of the near half is taken as water. Without a water column the whole row is
  // bed. Beyond some range there may be no echo, so the level is that of the samples above 0.
  const double water =
      level_below(row.first(std::max(row.size() / 2, recorded_from)).subspan(recorded_from), 0.1);
  std::vector<double> received;
  for (const double value : row.subspan(row.size() / 4))
    if (value > 0.0) received.push_back(value);
  const double level = level_below(received, 0.5);
  if (!(level > 0.0)) return std::nullopt;
  const double threshold = std::sqrt(std::max(water, 1e-3 * level) * level);
  std::vector<Rise> rises;
  std::size_t k = recorded_from + 2;
  while (k < row.size() && row[k] >= threshold) ++k;  // the transmit leakage
  bool in_echo = false;
  double bright = 0.0;
  constexpr std::size_t most = 8;
  for (std::size_t alike = 0; k < row.size() && rises.size() < most; ++k) {
    const bool above = row[k] >= threshold;
    if (above) bright += 1.0;
    alike = above != in_echo ? alike + 1 : 0;
    if (alike < lasting) continue;
    in_echo = above;
    alike = 0;
    if (!in_echo) continue;
    const std::size_t clear = k + 1 - lasting;
    const std::size_t first =
        known.growth.empty() ? clear : foot_of(row, known, clear, darkest_of_level * level);
    if (rises.empty() || first > rises.back().sample)  // else the rise before has this foot, too
      rises.push_back({first, std::max(bright - lasting, 0.0) / static_cast<double>(clear)});
  }
  return rises;
}

Growth growth_of_water(Smooth& smooth, const RecordedLine& line, std::size_t recorded_from) {
  constexpr double steepest = 2.0;  // amplitudes grow by at most 40 dB per factor of ten in range
  constexpr std::size_t fewest = 6;
  Growth growth(line.samples, 1.0);
  std::vector<double> powers;  // exponents of the growth with range, by ping
  for (std::size_t ping = 0; ping < line.pings.size(); ++ping) {
    const std::span<const double> row = smooth.row(ping);
    const auto rises = rises_of(row, {{}, recorded_from, 1.0});
    if (!rises || rises->empty()) continue;
    // Compares the third and the fourth eighth of the samples before the bed.
    const std::size_t part = rises->front().sample / 8;
    if (part < fewest || 2 * part < recorded_from + 2) continue;
    const double change =
        mean_of(row.subspan(3 * part, part)) / mean_of(row.subspan(2 * part, part));
    if (change > 0.0 && std::isfinite(change))
      powers.push_back(std::log(change) / std::log(3.5 / 2.5));
  }
  if (powers.empty()) return growth;
  const double power = std::clamp(median(std::move(powers)), 0.0, steepest);
  for (std::size_t k = 0; k < line.samples; ++k)
    growth[k] = std::pow(static_cast<double>(k) + 0.5, power);
  return growth;
}

using BedSamples = std::vector<std::optional<double>>;

/// By ping: the first sample of the bed according to the stated altitude and pitch.
BedSamples stated_samples(const RecordedLine& line) {
  BedSamples stated(line.pings.size());
  for (std::size_t i = 0; i < stated.size(); ++i) {
    const RecordedPing& ping = line.pings[i];
    if (ping.range_m > 0.0 && ping.altitude_m)
      stated[i] = *ping.altitude_m / std::cos(ping.pitch_rad.value_or(0.0)) / ping.range_m *
                      static_cast<double>(line.samples) -
                  static_cast<double>(bed_found_early);
  }
  return stated;
}

/// Moves all stated samples by the distance to a rise that at least half of the pings have, within
/// `near`. If there is no such distance, removes all stated samples.
void move_to_rises(const std::vector<std::vector<Rise>>& rises, double near, BedSamples& stated) {
  std::vector<double> off;
  std::size_t pings = 0;
  for (std::size_t i = 0; i < rises.size(); ++i) {
    if (!stated[i] || rises[i].empty()) continue;
    ++pings;
    for (const Rise& rise : rises[i]) off.push_back(static_cast<double>(rise.sample) - *stated[i]);
  }
  std::ranges::sort(off);
  std::size_t most = 0, middle = 0;
  for (std::size_t first = 0, end = 0; first < off.size(); ++first) {
    while (end < off.size() && off[end] <= off[first] + near) ++end;
    if (end - first <= most) continue;
    most = end - first;
    middle = first + most / 2;
  }
  for (std::optional<double>& sample : stated)
    if (sample && 2 * most >= pings && most > 0)
      *sample += off[middle];
    else
      sample.reset();
}

/// The number of pings from one ping to another, more than one if pings between are missing.
double pings_between(const RecordedPing& before, const RecordedPing& after) {
  return after.number > before.number ? static_cast<double>(after.number - before.number) : 1.0;
}

/// By ping: the rise on the bottom line, which is the chain of rises with the least cost. Unset in
/// pings that the chain leaves out.
BedSamples followed_rises(const RecordedLine& line, const std::vector<std::vector<Rise>>& rises,
                          double near, const BedSamples& stated) {
  // The unit of costs is the cost of a ping that is left out.
  constexpr double jump = 50.0, not_as_stated = 0.5, all_echo_before = 0.25;
  constexpr std::size_t reach = 40;  // pings that a chain may leave out without a jump
  constexpr auto none = std::numeric_limits<std::size_t>::max();
  struct Link {
    std::size_t ping;
    double sample, cost;  // the cost of the chain that ends at this link
    std::size_t before;   // the link before; none: the chain begins here
  };
  std::vector<Link> links;
  std::vector<std::size_t> first_link;  // by ping
  // The last link of the chain with the least cost among the chains that end farther back than the
  // reach; all later pings are left out.
  std::size_t far_back = none;
  const auto cost_at = [&](std::size_t link, std::size_t ping) {
    return links[link].cost + static_cast<double>(ping - links[link].ping - 1);
  };
  for (std::size_t ping = 0; ping < rises.size(); ++ping) {
    first_link.push_back(links.size());
    if (ping > reach)
      for (std::size_t k = first_link[ping - reach - 1]; k < first_link[ping - reach]; ++k)
        if (far_back == none || cost_at(k, ping) < cost_at(far_back, ping)) far_back = k;
    const std::size_t within = first_link[ping < reach ? 0 : ping - reach];
    for (const Rise& rise : rises[ping]) {
      const auto sample = static_cast<double>(rise.sample);
      Link best{ping, sample, static_cast<double>(ping), none};
      const auto take = [&](std::size_t link, double step) {
        if (const double cost = cost_at(link, ping) + step; cost < best.cost) {
          best.cost = cost;
          best.before = link;
        }
      };
      if (far_back != none) take(far_back, jump);
      for (std::size_t k = within; k < first_link[ping]; ++k) {
        const double between = pings_between(line.pings[links[k].ping], line.pings[ping]);
        const double off =
            std::abs(sample - links[k].sample) / (near * (1.0 + 0.1 * (between - 1.0)));
        take(k, jump * std::clamp(off - 1.0, 0.0, 1.0));
      }
      best.cost += all_echo_before * rise.echo_before;
      if (stated[ping])
        best.cost += not_as_stated * std::min(std::abs(sample - *stated[ping]) / near, 1.0);
      links.push_back(best);
    }
  }
  BedSamples followed(rises.size());
  std::size_t last = none;
  for (std::size_t k = 0; k < links.size(); ++k)
    if (last == none || cost_at(k, rises.size()) < cost_at(last, rises.size())) last = k;
  for (; last != none; last = links[last].before) followed[links[last].ping] = links[last].sample;
  return followed;
}

/// Whether the bed begins at the stated altitudes, far before the samples show it clearly. Then the
/// samples behind these altitudes are brighter, on average over all pings, than those before them.
bool begins_as_stated(const RecordedLine& line, Side side, const Growth& growth,
                      const BedSamples& stated, const BedSamples& bed) {
  constexpr double long_before = 1.08, brighter = 1.15, standard_errors = 3.0;
  std::vector<double> late;
  double before = 0.0, behind = 0.0, squares = 0.0, level = 0.0;  // sums over pings
  for (std::size_t i = 0; i < bed.size(); ++i) {
    if (!stated[i] || !bed[i]) continue;
    const double edge = *stated[i] + static_cast<double>(bed_found_early);
    const std::span<const float> row = line.row(side, i);
    const auto mean = [&](double from, double to) {
      const auto first = static_cast<std::size_t>(std::ceil(from)),
                 end = std::min(static_cast<std::size_t>(std::ceil(to)), line.samples);
      double sum = 0.0;
      for (std::size_t k = first; k < end; ++k) sum += row[k] / growth[k];
      return sum / static_cast<double>(end - first);
    };
    constexpr double shortest = 24.0;
    if (!(edge >= shortest) || !(*bed[i] > edge + static_cast<double>(bed_found_early)) ||
        std::max(long_before * edge, *bed[i]) + 1.0 > static_cast<double>(line.samples))
      continue;
    late.push_back(*bed[i] / *stated[i]);
    before += mean(0.7 * edge, 0.92 * edge);
    level += mean(*bed[i], static_cast<double>(line.samples));
    // At most up to halfway to the found bed, which begins a little earlier in single pings.
    const double its = mean(edge, std::min(long_before * edge, 0.5 * (edge + *bed[i])));
    behind += its;
    squares += its * its;
  }
  const auto pings = static_cast<double>(late.size());
  if (2.0 * pings < static_cast<double>(bed.size()) || !(median(std::move(late)) > long_before))
    return false;
  const double error = std::sqrt(std::max(squares - behind * behind / pings, 0.0));  // of `behind`
  return behind - standard_errors * error > std::max(brighter * before, darkest_of_level * level);
}

/// Whether the recording begins behind the first echo of the bed: the altitudes of most pings state
/// this, and no samples are much darker than the median, as water would be.
bool begins_behind_bed(Smooth& smooth, std::size_t recorded_from, const BedSamples& stated) {
  constexpr double much_darker = 2.0;  // 6 dB
  const auto before = static_cast<std::size_t>(std::ranges::count_if(
      stated, [&](const auto& sample) { return sample && *sample < double(recorded_from); }));
  if (recorded_from == 0 || 2 * before < stated.size()) return false;
  std::vector<double> ratios;
  for (std::size_t ping = 0; ping < stated.size(); ++ping) {
    const std::span<const double> row = smooth.row(ping).subspan(recorded_from);
    if (const double dark = level_below(row, 0.1); dark > 0.0)
      ratios.push_back(level_below(row, 0.5) / dark);
  }
  return 2 * ratios.size() >= stated.size() && median(std::move(ratios)) < much_darker;
}

/// FoundBed::water_darker_db. If the line was found too far, behind a dark part of the bed, parts
/// before it are bright bed. Fish may be bright, too, but do not fill all of a dark column.
double water_darker_db(const RecordedLine& line, Side side, std::size_t recorded_from,
                       const BedSamples& bed) {
  constexpr std::size_t fewest = 8;  // samples
  // Shares of the bed's range. The transmit leakage is before 0.33; the bed rises from 0.92 to 1.1.
  constexpr std::array<double, 4> parts{0.33, 0.53, 0.73, 0.92};
  constexpr double bed_begin = 1.1, bed_end = 2.0;
  constexpr double dark_db = 10.0;
  double darker_db = std::numeric_limits<double>::quiet_NaN(), darkest_db = darker_db;
  for (std::size_t part = 0; part + 1 < parts.size(); ++part) {
    std::vector<double> ratios;  // by ping
    for (std::size_t ping = 0; ping < bed.size(); ++ping) {
      if (!bed[ping]) continue;
      const std::span<const float> row = line.row(side, ping);
      const auto mean = [&](double from, double to) {
        const auto first = std::max(static_cast<std::size_t>(from * *bed[ping]), recorded_from),
                   end = std::min(static_cast<std::size_t>(to * *bed[ping]), line.samples);
        if (end < first + fewest) return std::numeric_limits<double>::quiet_NaN();
        const std::span<const float> samples = row.subspan(first, end - first);
        return std::accumulate(samples.begin(), samples.end(), 0.0) /
               static_cast<double>(samples.size());
      };
      const double ratio = mean(bed_begin, bed_end) / mean(parts[part], parts[part + 1]);
      if (!std::isnan(ratio)) ratios.push_back(ratio);
    }
    if (2 * ratios.size() < bed.size() || ratios.empty()) continue;
    const double its_db = scatter::amplitude_to_db(median(std::move(ratios)));
    darker_db = std::fmin(darker_db, its_db);
    darkest_db = std::fmax(darkest_db, its_db);
  }
  return darkest_db > dark_db ? darkest_db : darker_db;
}

}  // namespace

void fill_gaps(std::vector<std::optional<double>>& values) {
  std::optional<std::size_t> before;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!values[i]) continue;
    for (std::size_t gap = before ? *before + 1 : 0; gap < i; ++gap)
      values[gap] =
          before ? std::lerp(*values[*before], *values[i],
                             static_cast<double>(gap - *before) / static_cast<double>(i - *before))
                 : *values[i];
    before = i;
  }
  if (before)
    std::fill(values.begin() + static_cast<std::ptrdiff_t>(*before), values.end(), values[*before]);
}

FoundBed find_bed(const RecordedLine& line, Side side) {
  const std::size_t pings = line.pings.size();
  const double near = std::max(6.0, static_cast<double>(line.samples) / 50.0);
  std::vector<std::vector<Rise>> rises(pings);
  std::vector<bool> silent(pings);
  Smooth smooth(line, side);
  std::size_t recorded_from = 0;
  for (const RecordedPing& ping : line.pings)
    recorded_from = std::max(recorded_from, ping.unrecorded);
  const Water water{growth_of_water(smooth, line, recorded_from), recorded_from,
                    range_cell(line, side)};
  for (std::size_t ping = 0; ping < pings; ++ping) {
    auto found = rises_of(smooth.row(ping), water);
    silent[ping] = !found;
    if (found) rises[ping] = std::move(*found);
  }
  BedSamples stated = stated_samples(line);
  const BedSamples as_stated = stated;
  move_to_rises(rises, near, stated);
  BedSamples bed = followed_rises(line, rises, near, stated);
  const auto known = [](const BedSamples& samples) {
    return static_cast<std::size_t>(
        std::ranges::count_if(samples, [](const auto& sample) { return sample.has_value(); }));
  };
  FoundBed found{.first_sample = std::vector<std::size_t>(pings)};
  const bool most_stated = 2 * known(as_stated) >= pings, few_followed = 2 * known(bed) < pings;
  found.stated = (most_stated && (few_followed || ranges_are_even(line, side))) ||
                 begins_behind_bed(smooth, recorded_from, as_stated);
  if (!found.stated) {
    // With too few or too dark pings for a chain, the first rise of each ping is used.
    for (std::size_t i = 0; few_followed && i < pings; ++i)
      bed[i] = rises[i].empty() ? 0.0 : static_cast<double>(rises[i].front().sample);
    found.water_darker_db = water_darker_db(line, side, recorded_from, bed);
    found.stated = begins_as_stated(line, side, water.growth, as_stated, bed) ||
                   (found.doubtful() && most_stated);
  }
  if (found.stated) {
    bed = as_stated;
    found.water_darker_db = std::numeric_limits<double>::quiet_NaN();
  }
  for (std::size_t i = 0; i < pings; ++i)
    if (!bed[i]) bed[i] = stated[i];
  fill_gaps(bed);
  const auto begin = static_cast<double>(recorded_from), end = static_cast<double>(line.samples);
  for (std::size_t i = 0; i < pings; ++i)
    found.first_sample[i] =
        silent[i]
            ? line.samples
            : static_cast<std::size_t>(std::clamp(std::round(bed[i].value_or(0.0)), begin, end));
  for (const std::size_t first : found.first_sample)
    found.edge.push_back(
        first > 0 && first + bed_found_early < line.samples ? first + bed_found_early : first);
  return found;
}

bool ranges_are_even(const RecordedLine& line, Side side) {
  constexpr std::size_t parts = 48,
                        leakage = 50;  // the transmit leakage may fill 1/50 of the range
  constexpr double even = 0.1;         // relative deviation; without such a gain it is 0.4 or more
  const std::size_t begin = line.samples / leakage;
  if (line.samples < 2 * parts ||
      std::ranges::any_of(line.pings, [](const auto& ping) { return ping.unrecorded > 0; }))
    return false;
  std::array<double, parts> sums{}, counts{};
  for (std::size_t ping = 0; ping < line.pings.size(); ++ping) {
    const std::span<const float> row = line.row(side, ping).first(line.pings[ping].samples);
    for (std::size_t k = begin; k < row.size(); ++k) {
      const std::size_t part = parts * (k - begin) / (line.samples - begin);
      sums[part] += row[k];
      counts[part] += 1.0;
    }
  }
  double mean = 0.0, squares = 0.0;
  for (std::size_t part = 0; part < parts; ++part) {
    const double level = counts[part] > 0.0 ? sums[part] / counts[part] : 0.0;
    mean += level / parts;
    squares += level * level / parts;
  }
  return mean > 0.0 && squares - mean * mean < even * even * mean * mean;
}

bool ranges_are_even(const RecordedLine& line) {
  return std::ranges::all_of(line.sides(), [&](Side side) { return ranges_are_even(line, side); });
}

}  // namespace ensonify::engine
