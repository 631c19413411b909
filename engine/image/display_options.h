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

/// What a column of a picture shows of several samples: their mean amplitude; the greatest
/// amplitude, as in displays that must not lose a small target; or the amplitude in the middle of
/// the column, as in displays that leave samples out.
enum class ColumnValue { mean, peak, middle };

/// The layer that a display shows.
enum class DisplayedLayer { sample, intensity };

/// How a waterfall becomes a picture: time-varied gain, normalisations, then amplitude to
/// brightness. The layers do not change. Without beam_normalisation, flat_field, equalised mapping
/// and smoothing, the picture of a line depends only on the scene and on this line, so a line can
/// be shown as soon as it is there.
struct Display {
  DisplayedLayer of = DisplayedLayer::sample;
  /// The gain is spreading * log10(range) dB, limited so that the noise has at most mid-brightness.
  /// Under a line array, 30 gives a bed of constant backscatter strength the same brightness at all
  /// ranges, 50 a bed with Lambert's law.
  double spreading = 40.0;
  bool absorption = true;  ///< whether the two-way absorption is compensated
  /// Columns are equally spaced in ground range, without the water column.
  bool slant_range_correction = false;
  /// A column is as wide as the usual distance of two rows along the track, so that the picture is
  /// to scale; but not narrower than a bin.
  bool speed_correction = false;
  ColumnValue column_value = ColumnValue::mean;
  /// Divide by the bed's median level at the same side and depression angle. The water column does
  /// not change.
  bool beam_normalisation = false;
  bool flat_field = false;  ///< divide by the median level of the bed in the same column
  /// Added to the automatic gain, with which a level bed would have its median at mid-brightness.
  double gain_db = 0.0;
  Mapping mapping = Mapping::gamma;
  double gamma = 0.9;      ///< brightness = amplitude^gamma
  double range_db = 50.0;  ///< of the logarithmic mapping, from black to white about the bed
  /// Standard deviation, in pixels, of the Gaussian that smooths the picture, as displays do that
  /// enlarge or interpolate. 0: not smoothed.
  double smoothing_px = 0.0;
  /// Standard deviation of a second Gaussian, along the track only: displays that show rows at even
  /// distances mix pings.
  double track_smoothing_px = 0.0;
  Palette palette = Palette::grey;
};

}  // namespace ensonify::engine
