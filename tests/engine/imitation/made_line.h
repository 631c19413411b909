#pragma once

// Lines whose numbers are known.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::tests {

using engine::degree;
using engine::GeographicPlace;
using engine::RecordedLine;

constexpr std::size_t samples = 500;
constexpr double range_m = 50.0, sample_m = range_m / samples;

/// How a line for a test is made.
struct MadeLine {
  std::size_t pings = 320;
  std::function<double(std::size_t ping)> altitude_m = [](std::size_t) { return 8.0; };
  int looks = 1;
  bool peak = false;
  double spreading = 30.0;  ///< of the gain; 30 makes a bed of this kind even
  double level = 0.1;       ///< rms amplitude over full scale of the bed at 10 m with that gain
  double column = 1e-3;
  double ping_mean = 0.0;
  bool logarithmic = false;  ///< over 80 dB
  bool square_root = false;
  double texture = 0.0;  ///< relative standard deviation of the amplitude
  bool ripples = false;  ///< beyond 15 m, each with a shadow that is longer with range
};

/// A level bed whose echo falls as r^-3, with Rayleigh amplitudes; 15 bits.
inline RecordedLine made_line(const MadeLine& how) {
  std::mt19937 random(3);
  std::exponential_distribution<double> power;
  std::normal_distribution<double> texture;
  RecordedLine line{.format = "XTF",
                    .frequency_hz = 400e3,
                    .sound_speed_mps = 1500.0,
                    .peak_detector = how.peak,
                    .samples = samples};
  for (std::size_t ping = 0; ping < how.pings; ++ping) {
    line.pings.push_back(
        {.number = ping,
         .t_s = 1e9 + 0.1 * static_cast<double>(ping),
         .place = GeographicPlace{55.0 * degree + 3e-8 * static_cast<double>(ping), 10.0 * degree},
         .depth_m = 20.0 - how.altitude_m(ping),
         .range_m = range_m,
         .samples = samples});
    for (std::vector<float>* side : {&line.port, &line.starboard}) {
      std::vector<double> row(samples);
      double mean = 0.0;
      for (std::size_t k = 0; k < samples; ++k) {
        const double r = (static_cast<double>(k) + 0.5) * sample_m;
        const bool water = r < how.altitude_m(ping);
        double rms =
            water ? how.column : how.level * std::pow(r / 10.0, (how.spreading - 30.0) / 20.0);
        constexpr double first_m = 15.0, period_m = 1.5;
        const double shadow = std::min(0.7, (r - first_m) / 50.0);  // as a share of the period
        if (how.ripples && r > first_m && std::fmod(r, period_m) < shadow * period_m)
          rms = how.column;
        if (how.texture > 0.0 && !water) rms *= std::max(0.0, 1.0 + how.texture * texture(random));
        double amplitude = 0.0;
        for (int look = 0; look < how.looks; ++look) {
          const double one = rms * std::sqrt(power(random));
          amplitude = how.peak ? std::max(amplitude, one) : amplitude + one / how.looks;
        }
        row[k] = amplitude;
        mean += amplitude / samples;
      }
      for (double amplitude : row) {
        if (how.ping_mean > 0.0) amplitude *= how.ping_mean / mean;
        if (how.logarithmic) amplitude = 1.0 + 20.0 * std::log10(std::max(amplitude, 1e-4)) / 80.0;
        if (how.square_root) amplitude = std::sqrt(amplitude);
        side->push_back(static_cast<float>(std::lround(32767.0 * std::clamp(amplitude, 0.0, 1.0))));
      }
    }
  }
  return line;
}

/// 4 to 12 m and back.
inline double varied_m(std::size_t ping) {
  return 8.0 + 4.0 * std::sin(2.0 * std::numbers::pi * static_cast<double>(ping) / 320.0);
}

}  // namespace ensonify::tests
