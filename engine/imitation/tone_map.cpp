#include <ensonify/engine/imitation/tone_map.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include <ensonify/engine/base/quantile.h>
#include <ensonify/engine/base/random.h>
#include <ensonify/engine/comparison/tone_change.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

constexpr double noticed_db = 4.0;    // least difference of two tones that is noticed
constexpr double of_object_db = 6.0;  // least level of an object over the bed around it

/// A block of the bed: its place and its level.
struct Spot {
  std::size_t ping, column;  // ping of its middle; column in blocks of samples
  double range_m;
  Eigen::Vector2d place_m;
  std::size_t cell;  // cell of grazing angle
  double decades;    // log10 of the range in metres
  double level_db;
};

std::vector<Spot> spots_of(const LineWithBed& line, Side side, const VehiclePath& path,
                           const RecorderSigns& recorder) {
  std::vector<Spot> spots;
  const std::vector<std::size_t>& bed = line.bed(side).edge;
  for (std::size_t ping = 0; ping + block_pings <= line.pings.size(); ping += block_pings) {
    const std::size_t middle = ping + block_pings / 2;
    const double sample_m = line.pings[middle].range_m / static_cast<double>(line.samples);
    const double turned =
        heading_rad(path, middle) + (side == Side::starboard ? 0.5 : -0.5) * std::numbers::pi;
    for (std::size_t k = bed[middle]; k + block_samples <= line.samples; k += block_samples) {
      double power = 0.0;
      for (std::size_t i = ping; i < ping + block_pings; ++i)
        for (const float value : line.row(side, i).subspan(k, block_samples)) {
          const double amplitude = expanded(value / recorder.full_scale, recorder);
          power += amplitude * amplitude / (block_pings * block_samples);
        }
      const double range_m = (static_cast<double>(k) + 0.5 * block_samples) * sample_m;
      const double altitude_m = path.altitude_m[middle];
      constexpr double steepest = 0.9;  // largest sine: below the sonar, a block spans many angles
      if (!(power > 0.0) || altitude_m > steepest * range_m) continue;
      const double ground_m = std::sqrt(range_m * range_m - altitude_m * altitude_m);
      spots.push_back({middle, k / block_samples, range_m,
                       Eigen::Vector2d(path.x_m[middle], path.y_m[middle]) +
                           ground_m * Eigen::Vector2d(std::sin(turned), std::cos(turned)),
                       grazing_cell(std::asin(altitude_m / range_m)), std::log10(range_m),
                       scatter::to_db(power)});
    }
  }
  return spots;
}

/// Subtracts from each level the mean level at the same grazing angle.
void take_off_mean_of_angle(std::vector<Spot>& spots) {
  std::array<double, grazing_cells> mean{}, number{};
  for (const Spot& spot : spots) {
    mean[spot.cell] += spot.level_db;
    number[spot.cell] += 1.0;
  }
  for (Spot& spot : spots) spot.level_db -= mean[spot.cell] / number[spot.cell];
}

/// For each block that is part of a single object or of its shadow: its difference in dB from the
/// median of the 49 blocks around it. 0 for other blocks. If more than 1 in 50 blocks differs by so
/// much, the bed itself is so uneven, and all values are 0.
std::vector<double> off_bed_db(const std::vector<Spot>& spots, std::size_t pings,
                               std::size_t samples) {
  constexpr std::size_t reach = 3;
  const std::size_t rows = pings / block_pings, columns = samples / block_samples;
  std::vector<const Spot*> grid(rows * columns);
  for (const Spot& spot : spots) grid[spot.ping / block_pings * columns + spot.column] = &spot;
  std::vector<double> off_db;
  std::vector<double> around_db;
  for (const Spot& spot : spots) {
    const std::size_t row = spot.ping / block_pings, column = spot.column;
    around_db.clear();
    for (std::size_t r = row - std::min(row, reach); r <= std::min(row + reach, rows - 1); ++r)
      for (std::size_t c = column - std::min(column, reach);
           c <= std::min(column + reach, columns - 1); ++c)
        if (const Spot* other = grid[r * columns + c]) around_db.push_back(other->level_db);
    const double one_db = spot.level_db - median(around_db);
    off_db.push_back(std::abs(one_db) > of_object_db ? one_db : 0.0);
  }
  if (50 * static_cast<std::size_t>(std::ranges::count(off_db, 0.0)) < 49 * off_db.size())
    std::ranges::fill(off_db, 0.0);
  return off_db;
}

/// The mean tone of a tile and its eight neighbours, as far as they are known.
std::optional<double> mean_around(const ToneMap& map, const std::vector<double>& tones,
                                  const std::vector<bool>& known, std::size_t tile) {
  const std::size_t row = tile / map.columns, column = tile % map.columns;
  double sum = 0.0, number = 0.0;
  for (std::size_t r = row == 0 ? 0 : row - 1; r <= std::min(row + 1, map.rows - 1); ++r)
    for (std::size_t c = column == 0 ? 0 : column - 1; c <= std::min(column + 1, map.columns - 1);
         ++c)
      if (known[r * map.columns + c]) {
        sum += tones[r * map.columns + c];
        number += 1.0;
      }
  return number > 0.0 ? std::optional(sum / number) : std::nullopt;
}

/// Fills unknown tiles with the mean of their neighbours, from the known tiles outwards. Then
/// replaces each tile by the mean around it, since a single tile shows speckle.
std::vector<double> smoothed(const ToneMap& map, std::vector<double> tones,
                             std::vector<bool>& known) {
  constexpr int spread = 4;
  for (int pass = 0; pass < spread; ++pass) {
    const std::vector<bool> before = known;
    const std::vector<double> from = tones;
    for (std::size_t tile = 0; tile < tones.size(); ++tile)
      if (const auto mean = mean_around(map, from, before, tile); !before[tile] && mean) {
        tones[tile] = *mean;
        known[tile] = true;
      }
  }
  const std::vector<double> single = tones;
  for (std::size_t tile = 0; tile < tones.size(); ++tile)
    if (known[tile]) tones[tile] = *mean_around(map, single, known, tile);
  return tones;
}

/// Makes the pixels, whose edge is a quarter of a tile's. Their tones are interpolated between the
/// tiles' middles. A tone between two steps is dithered: each pixel gets one of the two steps at
/// random, so that slow changes show no edges.
void draw_steps(const std::vector<double>& tones, ToneMap& map) {
  constexpr std::size_t finer = 4;
  const std::size_t tile_columns = map.columns, tile_rows = map.rows;
  map.columns *= finer;
  map.rows *= finer;
  map.steps.reserve(map.columns * map.rows);
  const auto place = [](std::size_t pixel, std::size_t tiles) {
    return std::clamp((static_cast<double>(pixel) + 0.5) / finer - 0.5, 0.0,
                      static_cast<double>(tiles - 1));
  };
  std::vector<double> draws(map.columns);
  for (std::size_t row = 0; row < map.rows; ++row) {
    const double y = place(row, tile_rows);
    const auto north = static_cast<std::size_t>(y);
    const double* const first = tones.data() + north * tile_columns;
    const double* const second = north + 1 < tile_rows ? first + tile_columns : first;
    RandomStream(1, Purpose::imitated_tones, {row}).uniform(draws);
    for (std::size_t column = 0; column < map.columns; ++column) {
      const double x = place(column, tile_columns);
      const auto west = static_cast<std::size_t>(x), east = std::min(west + 1, tile_columns - 1);
      const double share = x - static_cast<double>(west);
      const double tone_db =
          std::lerp(std::lerp(first[west], first[east], share),
                    std::lerp(second[west], second[east], share), y - static_cast<double>(north));
      const double step = std::ceil(tone_db / ToneMap::step_db - draws[column]);
      map.steps.push_back(static_cast<std::int8_t>(
          std::clamp<double>(step, -ToneMap::max_steps, ToneMap::max_steps)));
    }
  }
}

}  // namespace

std::vector<BrightObject> bright_objects(const LineWithBed& line, const VehiclePath& path,
                                         const RecorderSigns& recorder) {
  std::vector<BrightObject> blocks;
  for (const Side side : line.sides()) {
    std::vector<Spot> spots = spots_of(line, side, path, recorder);
    take_off_mean_of_angle(spots);
    const std::vector<double> off_db = off_bed_db(spots, line.pings.size(), line.samples);
    for (std::size_t i = 0; i < spots.size(); ++i)
      if (off_db[i] > 0.0) blocks.push_back({spots[i].ping, side, spots[i].range_m, off_db[i]});
  }
  std::ranges::stable_sort(blocks, std::ranges::greater{}, &BrightObject::over_bed_db);
  // Blocks next to a brighter block belong to the same object.
  const double next_m =
      2.0 * block_samples * line.pings.front().range_m / static_cast<double>(line.samples);
  std::vector<BrightObject> objects;
  for (const BrightObject& block : blocks) {
    const bool same = std::ranges::any_of(objects, [&](const BrightObject& object) {
      const std::size_t apart =
          std::max(object.ping, block.ping) - std::min(object.ping, block.ping);
      return object.side == block.side && apart <= 2 * block_pings &&
             std::abs(object.range_m - block.range_m) <= next_m;
    });
    if (!same) objects.push_back(block);
  }
  return objects;
}

ToneMap tone_map(const LineWithBed& line, const VehiclePath& path, const RecorderSigns& recorder,
                 double range_slope_db, double extent_east_m, double extent_north_m) {
  ToneMap map;
  const double range_m = line.pings.front().range_m;
  const double tile_m = std::max({1.0, range_m / 30.0, extent_east_m / 500.0});
  map.columns = static_cast<std::size_t>(std::ceil(extent_east_m / tile_m));
  const double side_m = extent_east_m / static_cast<double>(map.columns);
  map.rows =
      std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(extent_north_m / side_m)));
  const double north_side_m = extent_north_m / static_cast<double>(map.rows);
  std::vector<double> sums(map.columns * map.rows, 0.0), counts(sums.size(), 0.0);
  // When the altitude changes, the gain over range changes the level. Remove this change.
  const double slope_db =
      recorder.ping_mean == 0.0 && std::isfinite(range_slope_db) ? range_slope_db : 0.0;
  for (const Side side : line.sides()) {
    std::vector<Spot> spots = spots_of(line, side, path, recorder);
    for (Spot& spot : spots) spot.level_db -= slope_db * spot.decades;
    take_off_mean_of_angle(spots);
    const std::vector<double> off_db = off_bed_db(spots, line.pings.size(), line.samples);
    for (std::size_t i = 0; i < spots.size(); ++i) {
      const Spot& spot = spots[i];
      if (off_db[i] != 0.0) continue;
      const double column = (spot.place_m.x() + 0.5 * extent_east_m) / side_m,
                   row = (0.5 * extent_north_m - spot.place_m.y()) / north_side_m;
      if (!(column >= 0.0 && row >= 0.0 && column < static_cast<double>(map.columns) &&
            row < static_cast<double>(map.rows)))
        continue;
      const std::size_t tile =
          static_cast<std::size_t>(row) * map.columns + static_cast<std::size_t>(column);
      sums[tile] += spot.level_db;
      counts[tile] += 1.0;
    }
  }
  std::vector<double> tones(sums.size(), 0.0);
  std::vector<bool> known(sums.size());
  for (std::size_t i = 0; i < sums.size(); ++i)
    if ((known[i] = counts[i] > 0.0)) tones[i] = sums[i] / counts[i];
  tones = smoothed(map, std::move(tones), known);
  std::size_t apart = 0, all = 0;
  for (std::size_t i = 0; i < tones.size(); ++i) {
    all += known[i];
    apart += std::abs(tones[i]) > 0.5 * noticed_db;
  }
  if (20 * apart >= all) draw_steps(tones, map);
  return map;
}

}  // namespace ensonify::engine
