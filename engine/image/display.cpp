#include <ensonify/engine/image/display.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

constexpr double seabed_amplitude = 0.35;       // where the median is put; gamma then brightens it
constexpr std::size_t median_pixels = 500'000;  // more tell no more
constexpr std::size_t depressions = 180;        // half degrees, from level to nadir

/// The waterfall's received intensity after gain, and what was evened out, pixel by pixel.
class Levels {
 public:
  Levels(const Waterfall& waterfall, const Display& display, double absorption_db_per_m,
         const Recorder* recorder)
      : waterfall_(waterfall),
        recorder_(display.of == PictureOf::sample ? recorder : nullptr),
        bins_(static_cast<std::size_t>(waterfall.sonar.bins)),
        ports_(waterfall.sonar.sides == Sides::starboard ? 0 : bins_),
        columns_(waterfall.columns()) {
    if (recorder_)
      for (std::uint32_t i = 0; recorder_->full_scale() <= 0xffff && i <= recorder_->full_scale();
           ++i)
        amplitudes_.push_back(static_cast<float>(recorder_->amplitude(i)));
    for (std::size_t column = 0; column < columns_; ++column) {
      const double r =
          std::max(static_cast<double>(bin_of(column)) + 0.5, 1.0) * waterfall.sonar.bin_m();
      double gain_db = display.spreading * std::log10(r);
      if (display.absorption) gain_db += 2.0 * absorption_db_per_m * r;
      gains_.push_back(scatter::from_db(gain_db));
      if (recorder_) {
        const double its = recorder_->gain(bin_of(column));
        gains_.back() /= its * its;
      }
    }
    if (display.beam_normalisation) normalise_beams();
    if (display.flat_field) flatten();
  }

  /// From nadir outwards.
  std::size_t bin_of(std::size_t column) const {
    return column < ports_ ? ports_ - 1 - column : column - ports_;
  }
  double at(std::size_t row, std::size_t column) const {
    return plain(row, column) * (beam_.empty() ? 1.0 : beam_gain(row, column));
  }
  bool seabed(std::size_t pixel) const {
    const auto region = static_cast<Region>(waterfall_.pixels.region[pixel]);
    return region == Region::seabed || region == Region::object;
  }
  /// The column that shows so much range over ground; none where nothing is known of it.
  static constexpr std::size_t none = ~std::size_t{0};
  std::size_t over_ground(std::size_t row, std::size_t column) const {
    const double bin_m = waterfall_.sonar.bin_m();
    const double over_m = (static_cast<double>(bin_of(column)) + 0.5) * bin_m;
    const double height_m = height(row);
    const auto bin =
        static_cast<std::size_t>(std::sqrt(over_m * over_m + height_m * height_m) / bin_m);
    if (bin >= bins_) return none;
    return column < ports_ ? ports_ - 1 - bin : ports_ + bin;
  }

 private:
  double plain(std::size_t row, std::size_t column) const {
    const std::size_t pixel = row * columns_ + column;
    if (!recorder_) return waterfall_.pixels.intensity[pixel] * gains_[column];
    const std::uint32_t sample = waterfall_.pixels.sample[pixel];
    const double amplitude =
        sample < amplitudes_.size() ? amplitudes_[sample] : recorder_->amplitude(sample);
    return amplitude * amplitude * gains_[column];
  }
  /// Over the bed: where the first echo comes from, or what the ping's record says.
  double height(std::size_t row) const {
    const PingRecord& ping = waterfall_.pings[row];
    if (ping.altitude_m > 0.0) return ping.altitude_m;
    return std::max({ping.first_return_port, ping.first_return_starboard, 0}) *
           waterfall_.sonar.bin_m();
  }
  std::size_t beam_cell(std::size_t row, std::size_t column) const {
    const double r = (static_cast<double>(bin_of(column)) + 0.5) * waterfall_.sonar.bin_m();
    const double depression = std::asin(std::min(1.0, height(row) / r));
    const auto cell =
        static_cast<std::size_t>(depression * 2.0 / std::numbers::pi * (depressions - 1));
    return (column < ports_ ? 0 : depressions) + cell;
  }
  double beam_gain(std::size_t row, std::size_t column) const {
    return beam_[beam_cell(row, column)];
  }
  /// The inverse of each cell's mean; 1 where there is none.
  template <class Cell>
  std::vector<double> inverse_means(std::size_t cells, Cell&& cell) const {
    std::vector<double> sums(cells), counts(cells);
    for (std::size_t row = 0; row < waterfall_.rows(); ++row)
      for (std::size_t column = 0; column < columns_; ++column)
        if (seabed(row * columns_ + column)) {
          const std::size_t into = cell(row, column);
          sums[into] += at(row, column);
          counts[into] += 1.0;
        }
    for (std::size_t i = 0; i < cells; ++i) sums[i] = sums[i] > 0.0 ? counts[i] / sums[i] : 1.0;
    return sums;
  }
  void normalise_beams() {
    beam_ = inverse_means(2 * depressions, [&](std::size_t row, std::size_t column) {
      return beam_cell(row, column);
    });
  }
  void flatten() {
    const std::vector<double> inverse =
        inverse_means(columns_, [](std::size_t, std::size_t column) { return column; });
    for (std::size_t column = 0; column < columns_; ++column) gains_[column] *= inverse[column];
  }

  const Waterfall& waterfall_;
  const Recorder* recorder_;
  std::size_t bins_, ports_, columns_;
  std::vector<double> gains_;      // of a column
  std::vector<double> beam_;       // of a depression, port's then starboard's
  std::vector<float> amplitudes_;  // of a sample
};

/// Levels where there is seabed or an object, ascending; of some pixels if there are very many.
std::vector<float> seabed_levels(const Waterfall& waterfall, const Levels& levels) {
  const std::size_t pixels = waterfall.rows() * waterfall.columns();
  const std::size_t step = 1 + pixels / median_pixels;
  std::vector<float> values;
  values.reserve(pixels / step + 1);
  for (std::size_t i = 0; i < pixels; i += step)
    if (levels.seabed(i))
      values.push_back(
          static_cast<float>(levels.at(i / waterfall.columns(), i % waterfall.columns())));
  std::ranges::sort(values);
  return values;
}

using Colour = std::array<double, 3>;

Colour colour_of(Palette palette, double brightness) {
  const double dark = 1.0 - brightness;
  switch (palette) {
    case Palette::grey: break;
    case Palette::
        copper:  // from black through orange-brown to pale yellow: red comes first, blue last
      return {1.0 - dark * dark, 0.95 * std::pow(brightness, 1.3),
              0.72 * std::pow(brightness, 3.0)};
    case Palette::bronze:
      return {std::pow(brightness, 0.8), std::pow(brightness, 1.1), std::pow(brightness, 1.9)};
    case Palette::paper: return {dark, dark, dark};
  }
  return {brightness, brightness, brightness};
}

}  // namespace

Picture render(const Waterfall& waterfall, const Display& display, double absorption_db_per_m,
               const Recorder* recorder, int bits) {
  const std::size_t rows = waterfall.rows(), columns = waterfall.columns();
  const Levels levels(waterfall, display, absorption_db_per_m, recorder);
  const std::vector<float> sorted = seabed_levels(waterfall, levels);
  const double median = sorted.empty() ? 0.0 : sorted[sorted.size() / 2];
  const double amplitude_gain = seabed_amplitude * scatter::from_db(0.5 * display.gain_db);
  const double scale = median > 0.0 ? amplitude_gain * amplitude_gain / median : 0.0;
  // Of a level, 0 to 1 and beyond.
  const auto brightness = [&](double level) {
    switch (display.mapping) {
      case Mapping::gamma: break;
      case Mapping::logarithmic:
        return level > 0.0 ? 1.0 + scatter::to_db(level * scale) / display.range_db : 0.0;
      case Mapping::equalised: {
        const auto above = std::ranges::lower_bound(sorted, static_cast<float>(level));
        return static_cast<double>(above - sorted.begin()) /
               static_cast<double>(std::max<std::size_t>(sorted.size(), 1));
      }
    }
    return std::pow(level * scale, 0.5 * display.gamma);
  };

  const bool coloured = display.palette == Palette::copper || display.palette == Palette::bronze;
  Picture picture{columns, rows, coloured ? 3 : 1, {}, bits};
  const double full = bits == 16 ? 65535.0 : 255.0;
  const auto channels = static_cast<std::size_t>(picture.channels);
  const std::size_t pixel_bytes = channels * (bits == 16 ? 2 : 1);
  std::vector<std::uint8_t> palette;  // a pixel's bytes for each brightness
  for (double step = 0.0; step <= full; step += 1.0) {
    const Colour colour = colour_of(display.palette, step / full);
    for (std::size_t k = 0; k < channels; ++k) {
      const auto value = static_cast<unsigned>(std::lround(full * colour[k]));
      if (bits == 16) palette.push_back(static_cast<std::uint8_t>(value >> 8));
      palette.push_back(static_cast<std::uint8_t>(value & 0xff));
    }
  }

  picture.pixels.resize(rows * columns * pixel_bytes);
  std::uint8_t* pixel = picture.pixels.data();
  for (std::size_t row = rows; row-- > 0;)
    for (std::size_t column = 0; column < columns; ++column) {
      const std::size_t from =
          display.slant_range_correction ? levels.over_ground(row, column) : column;
      const double light = from == Levels::none ? 0.0 : brightness(levels.at(row, from));
      const auto step = static_cast<std::size_t>(std::lround(full * std::clamp(light, 0.0, 1.0)));
      pixel = std::copy_n(&palette[step * pixel_bytes], pixel_bytes, pixel);
    }
  return picture;
}

}  // namespace ensonify::engine
