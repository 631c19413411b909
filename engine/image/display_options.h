#pragma once

namespace ensonify::engine {

enum class Palette { grey, copper, bronze, paper, viridis };

/// How amplitude becomes brightness.
enum class Mapping { gamma, logarithmic, equalised };

/// The layer that is shown.
enum class DisplayedLayer { sample, intensity };

/// How a waterfall becomes a picture: time-varied gain, what is evened out, then amplitude to
/// brightness. The layers stay as they are. Unless something is evened out or equalised, a line's
/// picture depends on the scene and on that line alone: it can be shown when it comes.
struct Display {
  DisplayedLayer of = DisplayedLayer::sample;
  double spreading = 40.0;  ///< gain of spreading * log10(range) dB; 30 levels a bed of constant
                            ///< strength under a line array, 50 one of Lambert's law
  bool absorption = true;   ///< and of the two-way absorption
  bool slant_range_correction =
      false;                        ///< columns are even in range over ground, without the water
  bool beam_normalisation = false;  ///< each side's mean level over depression is taken out
  bool flat_field = false;          ///< the mean level of each column is
  double gain_db = 0.0;  ///< added to the automatic gain, which puts the median of the scene's own
                         ///< bed, were it level, at mid-brightness
  Mapping mapping = Mapping::gamma;
  double gamma = 0.7;      ///< brightness = amplitude^gamma
  double range_db = 50.0;  ///< of a logarithmic mapping, from black to white
  Palette palette = Palette::grey;
};

}  // namespace ensonify::engine
