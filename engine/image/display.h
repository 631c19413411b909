#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include <ensonify/engine/image/waterfall.h>

namespace ensonify::engine {

enum class Palette { grey, copper, bronze, paper };

/// How amplitude becomes brightness.
enum class Mapping { gamma, logarithmic, equalised };

/// The layer that is shown.
enum class PictureOf { sample, intensity };

/// How a waterfall becomes a picture: time-varied gain, what is evened out, then amplitude to brightness.
/// The layers stay as they are.
struct Display {
  PictureOf of = PictureOf::sample;
  double spreading = 40.0;  ///< gain of spreading * log10(range) dB; 30 levels a bed of constant
                            ///< strength under a line array, 50 one of Lambert's law
  bool absorption = true;   ///< and of the two-way absorption
  bool slant_range_correction =
      false;                        ///< columns are even in range over ground, without the water
  bool beam_normalisation = false;  ///< each side's mean level over depression is taken out
  bool flat_field = false;          ///< the mean level of each column is
  double gain_db =
      0.0;  ///< added to the automatic gain, which puts the seabed's median at mid-brightness
  Mapping mapping = Mapping::gamma;
  double gamma = 0.7;      ///< brightness = amplitude^gamma
  double range_db = 50.0;  ///< of a logarithmic mapping, from black to white
  Palette palette = Palette::grey;
};

/// Pixels row by row from the top: grey, or red, green and blue; of 16 bits the higher byte comes first.
struct Picture {
  std::size_t width = 0;
  std::size_t height = 0;
  int channels = 1;
  std::vector<std::uint8_t> pixels;
  int bits = 8;  ///< a channel, 8 or 16
};

/// The picture of a waterfall: newest ping on top, port left, which is the seabed seen from above.
/// Pings of which nothing was received stay black. Without a recorder, which tells what samples stand
/// for, the intensity is shown.
Picture render(const Waterfall& waterfall, const Display& display, double absorption_db_per_m,
               const Recorder* recorder = nullptr, int bits = 8);

}  // namespace ensonify::engine
