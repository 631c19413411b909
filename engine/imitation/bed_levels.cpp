#include <ensonify/engine/imitation/bed_levels.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/base/quantile.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/engine/comparison/tone_change.h>
#include <ensonify/engine/imitation/vehicle_path.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

constexpr double unknown_level = std::numeric_limits<double>::quiet_NaN();

/// The mean power s of exponentially distributed intensities of which clipping at 1 leaves the mean
/// `power` = s (1 - exp(-1 / s)).
double before_clipping(double power) {
  constexpr double most = 0.98;
  const double wanted = std::min(power, most);
  double low = wanted, high = 100.0;
  for (int i = 0; i < 40; ++i) {
    const double s = std::sqrt(low * high);
    (s * -std::expm1(-1.0 / s) < wanted ? low : high) = s;
  }
  return low;
}

/// The levels of one side, by cell of grazing angle. If the recorder scales each ping, the levels
/// are relative to the water column of the same ping, which has the same scale.
std::array<std::vector<LevelAtRange>, grazing_cells> levels_at_ranges(
    const LineWithBed& line, Side side, const RecorderSigns& recorder) {
  constexpr std::size_t block = 24, low_cell = 5, high_cell = 36;  // 10 to 72 degrees
  std::array<std::vector<LevelAtRange>, grazing_cells> points;
  const std::vector<std::size_t>& bed = line.bed(side).edge;
  for (std::size_t ping = 0; ping + block <= line.pings.size(); ping += block) {
    const std::size_t middle = ping + block / 2;
    if (bed[middle] < 24 || bed[middle] >= line.samples) continue;
    std::vector<double> column;
    for (std::size_t i = ping; i < ping + block; ++i)
      for (std::size_t k = column_begin(line.pings[i], bed[i]);
           bed[i] < line.samples && k < bed[i] * 9 / 10; ++k)
        column.push_back(expanded(line.row(side, i)[k] / recorder.full_scale, recorder));
    const double floor = median(std::move(column));
    if (recorder.ping_mean > 0.0 && !(floor > 0.0)) continue;
    const double scale_db = recorder.ping_mean > 0.0 ? scatter::amplitude_to_db(floor) : 0.0;
    const GrazingLevels levels = grazing_levels(line, side, recorder, ping, ping + block, 8);
    const double altitude_m = nearest_bed(line, middle, bed[middle]) * line.pings[middle].range_m /
                              static_cast<double>(line.samples);
    for (std::size_t cell = low_cell; cell < high_cell; ++cell)
      if (std::isfinite(levels[cell]))
        points[cell].push_back({ping / block,
                                std::log10(altitude_m / std::sin(grazing_cell_rad(cell))),
                                levels[cell] - scale_db});
  }
  return points;
}

}  // namespace

SharedSlope shared_slope(const std::vector<std::vector<LevelAtRange>>& cells, std::size_t first,
                         std::size_t end) {
  SharedSlope slope;
  for (const std::vector<LevelAtRange>& cell : cells) {
    double x = 0.0, y = 0.0, number = 0.0;
    const auto over_points = [&](auto&& take) {
      for (const LevelAtRange& point : cell)
        if (point.block < first || point.block >= end) take(point);
    };
    over_points([&](const LevelAtRange& point) {
      x += point.decades;
      y += point.level_db;
      number += 1.0;
    });
    over_points([&](const LevelAtRange& point) {
      slope.variance += std::pow(point.decades - x / number, 2);
      slope.covariance += (point.decades - x / number) * (point.level_db - y / number);
    });
  }
  return slope;
}

double grazing_cell_rad(std::size_t cell) {
  return (static_cast<double>(cell) + 0.5) * grazing_cell_deg * degree;
}

std::size_t grazing_cell(double grazing_rad) {
  return std::min(static_cast<std::size_t>(grazing_rad / degree / grazing_cell_deg),
                  grazing_cells - 1);
}

GrazingLevels grazing_levels(const LineWithBed& line, Side side, const RecorderSigns& recorder,
                             std::size_t first, std::size_t end, std::size_t enough) {
  GrazingLevels sums{}, counts{};
  const std::vector<std::size_t>& bed = line.bed(side).edge;
  for (std::size_t ping = first; ping < end; ++ping) {
    const std::span<const float> row = line.row(side, ping);
    if (bed[ping] == 0) continue;
    const double altitude = nearest_bed(line, ping, bed[ping]);
    for (std::size_t k = bed[ping]; k < line.samples; ++k) {
      const double grazing = std::asin(std::min(1.0, altitude / static_cast<double>(k)));
      const std::size_t cell = grazing_cell(grazing);
      const double amplitude = expanded(row[k] / recorder.full_scale, recorder);
      sums[cell] += amplitude * amplitude;
      counts[cell] += 1.0;
    }
  }
  for (std::size_t i = 0; i < grazing_cells; ++i)
    sums[i] = counts[i] >= static_cast<double>(enough) && sums[i] > 0.0
                  ? scatter::to_db(before_clipping(sums[i] / counts[i]))
                  : unknown_level;
  return sums;
}

std::array<GrazingLevels, 2> grazing_levels_of_sides(const LineWithBed& line,
                                                     const RecorderSigns& recorder) {
  std::array<GrazingLevels, 2> levels;
  for (const Side side : {Side::port, Side::starboard}) {
    GrazingLevels& its = levels[static_cast<std::size_t>(side)];
    its.fill(unknown_level);
    if (!line.side(side).empty()) its = grazing_levels(line, side, recorder, 0, line.pings.size());
  }
  return levels;
}

GrazingLevels mean_of_sides(const std::array<GrazingLevels, 2>& levels_db) {
  GrazingLevels mean;
  for (std::size_t i = 0; i < grazing_cells; ++i) {
    const double port = levels_db[0][i], starboard = levels_db[1][i];
    mean[i] = std::isnan(port)        ? starboard
              : std::isnan(starboard) ? port
                                      : 0.5 * (port + starboard);
  }
  return mean;
}

double range_slope_db(const LineWithBed& line, const RecorderSigns& recorder) {
  if (recorder.has_automatic_gain()) return unknown_level;
  std::vector<std::vector<LevelAtRange>> cells;  // the cells of both sides
  std::size_t blocks = 0;
  for (const Side side : line.sides()) {
    for (std::vector<LevelAtRange>& cell : levels_at_ranges(line, side, recorder)) {
      if (cell.size() < 4) continue;
      blocks = std::max(blocks, cell.back().block + 1);
      cells.push_back(std::move(cell));
    }
  }
  const SharedSlope slope = shared_slope(cells, 0, 0);
  // About 10 blocks in each of 30 cells, whose altitudes differ by about a tenth.
  constexpr double enough_variance = 0.3;
  if (!(slope.variance > enough_variance)) return unknown_level;
  // Patches of the bed may look like a change with range. In that case the slope changes much if a
  // part of the line is left out (the jackknife).
  constexpr std::size_t most_parts = 8;
  const std::size_t parts = std::min(most_parts, blocks);
  double sum = 0.0, squares = 0.0;
  for (std::size_t part = 0; part < parts; ++part) {
    const double without =
        shared_slope(cells, part * blocks / parts, (part + 1) * blocks / parts).value() -
        slope.value();
    sum += without;
    squares += without * without;
  }
  const auto number = static_cast<double>(parts);
  const double error_db = std::sqrt((number - 1.0) * (squares - sum * sum / number) / number);
  constexpr double most_error_db = 6.0;  // the deviation of usual gains, 20 to 40
  return error_db < most_error_db ? slope.value() : unknown_level;
}

RangeLaw corrected_law(const RangeLaw& law, double slope_db, double ours_db,
                       double absorption_db_per_m, double range_m) {
  if (!std::isfinite(slope_db) || !std::isfinite(ours_db)) return law;
  RangeLaw better{law.spreading + slope_db - ours_db,
                  law.absorption,
                  {Confidence::fitted,
                   fmt::format("at each angle the level changes by {:.0f} dB per factor of ten in "
                               "range",
                               slope_db)}};
  constexpr double min_spreading = 10.0;
  if (better.absorption && better.spreading < min_spreading) {
    better.absorption = false;  // the absorption's slope: of 2 a r over log10(r), at half the range
    better.spreading += std::numbers::ln10 * absorption_db_per_m * range_m;
  }
  constexpr double least = 0.0, most = 80.0;
  better.spreading = std::clamp(better.spreading, least, most);
  better.from = within_limits(std::move(better.from), better.spreading, least, most);
  return better;
}

double lasting_peaks(const LineWithBed& line) {
  constexpr double bright = 4.0, lowest_rad = 8.0 * degree, highest_rad = 20.0 * degree;
  constexpr double fewest = 30.0;
  double sum = 0.0, peaks = 0.0;
  for (const Side side : line.sides()) {
    const std::vector<std::size_t>& bed = line.bed(side).edge;
    for (std::size_t ping = 0; ping + block_pings <= line.pings.size(); ping += block_pings) {
      const auto nearest = static_cast<double>(bed[ping + block_pings / 2]);
      const auto first = static_cast<std::size_t>(std::ceil(nearest / std::sin(highest_rad)));
      for (std::size_t sample = first; sample + block_samples <= line.samples &&
                                       nearest > std::sin(lowest_rad) * static_cast<double>(sample);
           sample += block_samples) {
        double mean = 0.0;
        for (std::size_t i = ping; i < ping + block_pings; ++i)
          for (const float value : line.row(side, i).subspan(sample, block_samples))
            mean += value / double{block_pings * block_samples};
        for (std::size_t i = ping + 1; i + 1 < ping + block_pings; ++i)
          for (std::size_t k = sample; k < sample + block_samples; ++k) {
            const double value = line.row(side, i)[k];
            if (!(value > bright * mean)) continue;
            const double around = 0.5 * (line.row(side, i - 1)[k] + line.row(side, i + 1)[k]);
            sum += (around - mean) / (value - mean);
            peaks += 1.0;
          }
      }
    }
  }
  return peaks < fewest ? std::numeric_limits<double>::quiet_NaN() : sum / peaks;
}

}  // namespace ensonify::engine
