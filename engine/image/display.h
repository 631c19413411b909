#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include <ensonify/engine/image/display_options.h>
#include <ensonify/engine/image/waterfall.h>

namespace ensonify::engine {

class Recorder;

/// Pixels row by row from the top: grey, or red, green and blue; of 16 bits the higher byte comes
/// first.
struct Picture {
  std::size_t width = 0;
  std::size_t height = 0;
  int channels = 1;
  std::vector<std::uint8_t> pixels;
  int bits = 8;  ///< a channel, 8 or 16
};

/// What a display knows of a sonar before its first ping.
struct Calibration {
  double absorption_db_per_m = 0.0;
  const Recorder* recorder = nullptr;  ///< what samples stand for; none: the intensity is shown
  /// Mean intensity, uPa^2, of the scene's bed in each of the waterfall's columns, were it level;
  /// 0: no echo.
  std::vector<double> level_bed;
  double median_share = 1.0;  ///< of a bed's intensity, median over mean: speckle's
  /// What automatic gains multiply that bed's amplitude by in each column, behind the recorder's
  /// own gain; empty: 1.
  std::vector<double> automatic_gain;
};

/// Where a display shows a bed whose level, in intensity, is the median of the scene's own: its
/// brightness to the power 1 / gamma.
inline constexpr double mid_amplitude = 0.35;

/// A sonar's display: from its lines to pixels.
class Renderer {
 public:
  /// The calibration's recorder must outlive it. Throws std::invalid_argument for a level bed
  /// without an echo, or of other columns than the sonar has.
  Renderer(const Sonar& sonar, const Display& display, const Calibration& calibration);

  /// The picture of a waterfall of that sonar, 8 or 16 bits a channel: newest ping on top, port
  /// left, which is the seabed seen from above. Pings of which nothing was received stay black.
  Picture render(const Waterfall& waterfall, int bits = 8) const;

  /// The intensity after all gain, of a waterfall's row by column, over that of mid-brightness.
  /// Without what is evened out.
  void levels(const Waterfall& waterfall, std::size_t row, std::span<float> into) const;

 private:
  friend class Levels;
  double level(const Waterfall& waterfall, std::size_t row, std::size_t column) const;
  double level(std::size_t column, double intensity, std::uint32_t sample) const;

  Sonar sonar_;
  Display display_;
  const Recorder* recorder_;
  std::size_t columns_, ports_;
  std::vector<double> gains_;      // of a column
  std::vector<float> amplitudes_;  // of a sample
  double median_share_;
  double scale_ = 1.0;  // puts the level bed's median at 1
};

/// The same in one go.
Picture render(const Waterfall& waterfall, const Display& display, const Calibration& calibration,
               int bits = 8);

/// Red, green and blue, each 0 to 1, of a brightness from 0 to 1.
std::array<double, 3> colour_of(Palette palette, double brightness);

}  // namespace ensonify::engine
