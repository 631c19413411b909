#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/engine/image/display_options.h>
#include <ensonify/engine/image/waterfall.h>

namespace ensonify::engine {

class Recorder;

/// Pixels row by row from the top: grey, or red, green and blue. With 16 bits, the high byte first.
struct Picture {
  std::size_t width = 0;
  std::size_t height = 0;
  int channels = 1;
  std::vector<std::uint8_t> pixels;
  int bits = 8;  ///< per channel, 8 or 16
};

/// What a display needs to know of a sonar before the first ping.
struct Calibration {
  double absorption_db_per_m = 0.0;
  /// The recorder that made the samples. Null: the display shows the intensity.
  const Recorder* recorder = nullptr;
  /// Mean intensity, uPa^2, in each column of the waterfall if the bed were level; 0: no echo.
  std::vector<double> level_bed;
  /// Mean noise power, uPa^2. The gain is limited so that the noise has at most mid-brightness.
  double noise = 0.0;
  double row_spacing_m = 0.0;  ///< usual distance of two rows along the track; 0: unknown
  double median_share = 1.0;   ///< median over mean of a bed's intensity, due to speckle
  /// For each column, the factor by which automatic gains multiply the level bed's amplitude after
  /// the recorder's gain. Empty: 1.
  std::vector<double> automatic_gain;
};

/// The rows directly before and after the rows of a waterfall, of the same sonar and run. Smoothing
/// needs them. There are smoothed_rows() on each side, fewer only where the run begins or ends.
struct NeighbourRows {
  Waterfall before, after;
};

/// How many rows on each side affect the pixels of a row, because the display smooths.
std::size_t smoothed_rows(const Display& display);

/// The amplitude at which the display shows the median level of the scene's level bed. Its
/// brightness is mid_amplitude^gamma, with a logarithmic mapping 0.5.
inline constexpr double mid_amplitude = 0.35;

/// Turns the lines of one sonar into pixels.
class Renderer {
 public:
  /// The calibration's recorder must outlive the renderer. Throws std::invalid_argument if the
  /// level bed has no echo, or if its number of columns is not the sonar's.
  Renderer(const Sonar& sonar, const Display& display, const Calibration& calibration);

  /// The picture of a waterfall of this sonar, 8 or 16 bits per channel: newest ping on top, port
  /// left, that is, the seabed seen from above. Pings without data stay black. Normalisations and
  /// equalised mapping use the waterfall only; smoothing also uses `neighbours`, if given. Throws
  /// std::invalid_argument for another number of columns.
  Picture render(const Waterfall& waterfall, int bits = 8,
                 const NeighbourRows* neighbours = nullptr) const;

  /// Writes to `into`, which has room for all columns, the intensity of one row of a waterfall
  /// after all gains, without normalisations. It is linear; 1 is shown at mid-brightness.
  void levels(const Waterfall& waterfall, std::size_t row, std::span<float> into) const;

 private:
  friend class Levels;
  double level(const Waterfall& waterfall, std::size_t row, std::size_t column) const;
  double level(std::size_t column, double intensity, std::uint32_t sample) const;

  Sonar sonar_;
  Display display_;
  const Recorder* recorder_;
  LineLayout layout_;
  std::size_t columns_;
  double row_spacing_m_;
  std::vector<double> gains_;      // by column
  std::vector<float> amplitudes_;  // by sample
  double scale_ = 1.0;             // factor that makes the level bed's median 1
};

/// Renderer's constructor and render() in one call. Throws what they throw.
Picture render(const Waterfall& waterfall, const Display& display, const Calibration& calibration,
               int bits = 8, const NeighbourRows* neighbours = nullptr);

/// A grey picture in the colours of a palette. The result is that of a Renderer with this palette.
Picture painted(Picture grey, Palette palette);

/// Red, green and blue, each 0 to 1. `brightness` must be from 0 to 1.
std::array<double, 3> colour_of(Palette palette, double brightness);

}  // namespace ensonify::engine
