#include <ensonify/engine/comparison/tone_change.h>

#include <cmath>
#include <limits>

#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

/// The level of a block, dB; NaN if the block begins before the bed or has zeros only.
double level_db(const RecordedLine& line, Side side, std::span<const std::size_t> bed,
                std::size_t ping, std::size_t sample) {
  double power = 0.0;
  for (std::size_t i = ping; i < ping + block_pings; ++i) {
    if (sample < bed[i]) return std::numeric_limits<double>::quiet_NaN();
    for (const float value : line.row(side, i).subspan(sample, block_samples))
      power += double{value} * value;
  }
  return power > 0.0 ? scatter::to_db(power) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

void add_tone_changes(const RecordedLine& line, Side side, std::span<const std::size_t> bed,
                      std::size_t first, std::size_t end,
                      std::array<std::vector<double>, tone_lags.size()>& squares_db2) {
  const std::size_t rows = (end - first) / block_pings, columns = line.samples / block_samples;
  std::vector<double> levels_db(rows * columns);
  for (std::size_t row = 0; row < rows; ++row)
    for (std::size_t column = 0; column < columns; ++column)
      levels_db[row * columns + column] =
          level_db(line, side, bed, first + row * block_pings, column * block_samples);
  for (std::size_t lag = 0; lag < tone_lags.size(); ++lag) {
    const std::size_t later = tone_lags[lag] / block_pings * columns;
    for (std::size_t i = 0; i + later < levels_db.size(); ++i) {
      const double change_db = levels_db[i + later] - levels_db[i];
      if (!std::isnan(change_db)) squares_db2[lag].push_back(change_db * change_db);
    }
  }
}

}  // namespace ensonify::engine
