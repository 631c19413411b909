#include <ensonify/engine/imitation/lasting_peaks.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/comparison/tone_change.h>
#include <ensonify/engine/imitation/vehicle_path.h>

namespace ensonify::engine {

double lasting_peaks(const RecordedLine& line) {
  constexpr double bright = 4.0, lowest_rad = 8.0 * degree, highest_rad = 20.0 * degree;
  constexpr double fewest = 30.0;
  double sum = 0.0, peaks = 0.0;
  for (const Side side : line.sides()) {
    const std::vector<std::size_t> bed = bed_edge(line, side);
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
