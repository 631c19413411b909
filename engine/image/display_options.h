#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace ensonify::engine {

enum class Palette { grey, copper, bronze, paper, viridis };
inline constexpr std::array<std::string_view, 5> palette_names{"grey", "copper", "bronze", "paper",
                                                               "viridis"};
constexpr std::string_view name_of(Palette palette) {
  return palette_names[static_cast<std::size_t>(palette)];
}

/// How amplitude becomes brightness.
enum class Mapping { gamma, logarithmic, equalised };

/// What a column of a picture shows of several samples: their mean amplitude, the greatest one, as
/// displays do that must not lose a small target, or the one in its middle, as displays do that
/// leave samples out.
enum class ColumnValue { mean, peak, middle };

/// The layer that a display shows.
enum class DisplayedLayer { sample, intensity };

/// How a waterfall becomes a picture: time-varied gain, normalisations, then amplitude to
/// brightness. The layers do not change. Without beam_normalisation, flat_field, equalised mapping
/// and smoothing, the picture of a line depends on the scene and that line only, so a line can be
/// shown at once.
struct Display {
  DisplayedLayer of = DisplayedLayer::sample;
  /// Gain of spreading * log10(range) dB. 30 makes a bed of constant backscatter strength even
  /// under a line array, 50 a bed with Lambert's law. The gain is limited so that noise is at most
  /// at mid-brightness.
  double spreading = 40.0;
  bool absorption = true;  ///< whether the two-way absorption is compensated
  /// Columns are equally spaced in ground range, without the water column.
  bool slant_range_correction = false;
  /// Columns are as wide as rows are usually apart along the track, but not narrower than a bin, so
  /// that the picture is to scale.
  bool speed_correction = false;
  ColumnValue column_value = ColumnValue::mean;
  /// Divide by the median level of the bed, of each side per depression angle. The water stays.
  bool beam_normalisation = false;
  bool flat_field = false;  ///< the same for each column
  /// Added to the automatic gain, which shows the scene's bed, if it were level, with its median
  /// at mid-brightness.
  double gain_db = 0.0;
  Mapping mapping = Mapping::gamma;
  double gamma = 0.9;      ///< brightness = amplitude^gamma
  double range_db = 50.0;  ///< of the logarithmic mapping, from black to white about the bed
  /// Standard deviation, in pixels, of the Gaussian that smooths the picture, as displays do that
  /// enlarge or interpolate. 0: not smoothed.
  double smoothing_px = 0.0;
  /// The same along the track alone, in addition: rows at even distances are mixtures of pings.
  double track_smoothing_px = 0.0;
  Palette palette = Palette::grey;
};

}  // namespace ensonify::engine
