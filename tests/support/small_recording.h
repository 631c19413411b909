#pragma once

#include <string>
#include <vector>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/output/recording.h>

namespace ensonify::tests {

/// A recording of three pings, of which the second number is missing; each sample differs.
inline engine::Recording small_recording(std::size_t bins = 5) {
  engine::Recording recording{.name = "towfish",
                              .frequency_hz = 455e3,
                              .bandwidth_hz = 40e3,
                              .pulse_length_s = 2.5e-3,
                              .range_m = 30.0,
                              .full_scale = {{}},
                              .sound_speed_mps = 1480.0,
                              .bins = bins};
  recording.gain_db.resize(3);
  for (std::size_t row = 0; row < 3; ++row) {
    recording.pings.push_back({.row = row,
                               .number = row == 0 ? 7u : 8u + row,
                               .unix_ms = 1709251199500 + 250 * static_cast<int>(row),
                               .interval_s = 0.25,
                               .place = {(55.0 + 1e-4 * static_cast<double>(row)) * engine::degree,
                                         -10.5 * engine::degree},
                               .heading_rad = (100.0 + static_cast<double>(row)) * engine::degree,
                               .pitch_rad = 2.0 * engine::degree,
                               .roll_rad = -3.0 * engine::degree,
                               .depth_m = 12.5,
                               .altitude_m = 7.25,
                               .speed_mps = 1.5});
    for (std::size_t i = 0; i < 2 * bins; ++i)
      recording.samples.push_back(static_cast<std::uint16_t>(100 * (row + 1) + i));
  }
  return recording;
}

inline std::string as_text(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace ensonify::tests
