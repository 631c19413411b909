#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include <ensonify/engine/image/waterfall.h>

namespace ensonify::engine {

enum class Palette { grey, copper };

/// How a waterfall becomes a picture: time-varied gain, then amplitude to brightness.
struct Display {
  double spreading = 40.0;  ///< gain of spreading * log10(range) dB; 30 levels a bed of constant
                            ///< strength under a line array, 50 one of Lambert's law
  bool absorption = true;   ///< and of the two-way absorption
  double gain_db =
      0.0;  ///< added to the automatic gain, which puts the seabed's median at mid-brightness
  double gamma = 0.7;  ///< brightness = amplitude^gamma
  Palette palette = Palette::grey;
};

/// 8-bit pixels, row by row from the top: grey, or red, green and blue.
struct Picture {
  std::size_t width = 0;
  std::size_t height = 0;
  int channels = 1;
  std::vector<std::uint8_t> pixels;
};

/// The picture of a waterfall: newest ping on top, port left, which is the seabed seen from above.
/// Pings of which nothing was received stay black.
Picture render(const Waterfall& waterfall, const Display& display, double absorption_db_per_m);

}  // namespace ensonify::engine
