#pragma once

#include <limits>
#include <string_view>

#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/output/attributes.h>

namespace ensonify::tests {

/// A small waterfall in which every value identifies its ping, side, bin and layer.
inline engine::Waterfall sample_waterfall(std::size_t pings = 7, int bins = 33) {
  engine::Sonar sonar;
  sonar.name = "port side \xc3\xa9";
  sonar.bins = bins;
  sonar.range_m = 16.5;
  sonar.frequency_hz = 455e3;
  engine::Waterfall waterfall(sonar, pings);
  for (std::size_t ping = 0; ping < pings; ++ping) {
    engine::EchoLine lines[2];
    for (const engine::Sector& sector : engine::sidescan_sectors) {
      engine::EchoLine& line = lines[sector.number == 1];
      line.sector = sector.number;
      line.bins.assign(static_cast<std::size_t>(bins));
      int layer_number = 0;
      engine::BinLayers::for_each([&](std::string_view, auto layer) {
        ++layer_number;
        for (int bin = 0; bin < bins; ++bin) {
          const int value =
              ((layer_number * 100 + static_cast<int>(ping)) * 2 + (sector.number == 1)) * bins +
              bin;
          auto& place = (line.bins.*layer)[static_cast<std::size_t>(bin)];
          place = static_cast<std::decay_t<decltype(place)>>(value);
          if constexpr (std::is_same_v<std::decay_t<decltype(place)>, float>) place += 0.1f;
        }
      });
    }
    lines[0].first_return = 3;
    lines[0].starved = 1;
    lines[1].first_return = 5;
    engine::PingRow record;
    record.pose = {0.5 * static_cast<double>(ping), {1.0 / 3.0, -2.0, -7.25}, 0.01, -0.02, 1.5};
    record.reported = {record.pose.t_s, {0.25, -2.125, -7.0}, 0.02, -0.01, 1.25};
    record.altitude_m = 10.5;
    record.block = static_cast<int>(ping / 4);
    waterfall.set_row(ping, lines, record);
  }
  // Values that a careless encoder would change.
  waterfall.pixels.intensity[1] = 1e30f;
  waterfall.pixels.intensity[2] = std::numeric_limits<float>::denorm_min();
  waterfall.pixels.x_m[3] = -0.0f;
  waterfall.pixels.instance[4] = 0xffffffffu;
  return waterfall;
}

inline const engine::ImageOrigin sample_origin{
    {148376.25, 6234000.1, -0.5},
    "0123456789abcdef",
    {{"none", "mine", "pot \"A\""}, {"none", "sandy mud"}}};

}  // namespace ensonify::tests
