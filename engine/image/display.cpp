#include <ensonify/engine/image/display.h>

#include <algorithm>
#include <array>
#include <cmath>

#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

constexpr double seabed_amplitude = 0.35;       // where the median is put; gamma then brightens it
constexpr std::size_t median_pixels = 500'000;  // more tell no more

/// Linear gain of each column's intensity.
std::vector<double> column_gains(const Waterfall& waterfall, const Display& display,
                                 double absorption_db_per_m) {
  const Sonar& sonar = waterfall.sonar;
  std::vector<double> gains(waterfall.columns());
  for (int bin = 0; bin < sonar.bins; ++bin) {
    const double r = std::max(bin + 0.5, 1.0) * sonar.bin_m();
    double gain_db = display.spreading * std::log10(r);
    if (display.absorption) gain_db += 2.0 * absorption_db_per_m * r;
    const auto from_nadir = static_cast<std::size_t>(bin);
    if (sonar.sides != Sides::starboard)
      gains[static_cast<std::size_t>(sonar.bins) - 1 - from_nadir] = scatter::from_db(gain_db);
    if (sonar.sides != Sides::port)
      gains[gains.size() - static_cast<std::size_t>(sonar.bins) + from_nadir] =
          scatter::from_db(gain_db);
  }
  return gains;
}

/// The median intensity after gain where there is seabed or an object; 0 where there is neither.
double seabed_median(const Waterfall& waterfall, const std::vector<double>& gains) {
  const Layers& pixels = waterfall.pixels;
  const std::size_t step = 1 + pixels.intensity.size() / median_pixels;
  std::vector<float> values;
  values.reserve(pixels.intensity.size() / step + 1);
  for (std::size_t i = 0; i < pixels.intensity.size(); i += step) {
    const auto region = static_cast<Region>(pixels.region[i]);
    if (region == Region::seabed || region == Region::object)
      values.push_back(static_cast<float>(pixels.intensity[i] * gains[i % gains.size()]));
  }
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

using Colour = std::array<std::uint8_t, 3>;

/// From black through orange-brown to pale yellow: red comes first, blue last.
Colour copper(double brightness) {
  const auto byte = [](double value) {
    return static_cast<std::uint8_t>(std::lround(255.0 * value));
  };
  const double dark = 1.0 - brightness;
  return {byte(1.0 - dark * dark), byte(0.95 * std::pow(brightness, 1.3)),
          byte(0.72 * std::pow(brightness, 3.0))};
}

}  // namespace

Picture render(const Waterfall& waterfall, const Display& display, double absorption_db_per_m) {
  const std::size_t rows = waterfall.rows(), columns = waterfall.columns();
  std::vector<double> gains = column_gains(waterfall, display, absorption_db_per_m);
  const double median = seabed_median(waterfall, gains);
  const double amplitude_gain = seabed_amplitude * scatter::from_db(0.5 * display.gain_db);
  const double scale = median > 0.0 ? amplitude_gain * amplitude_gain / median : 0.0;
  for (double& gain : gains) gain *= scale;

  std::array<Colour, 256> palette;
  for (std::size_t i = 0; i < palette.size(); ++i) {
    const auto grey = static_cast<std::uint8_t>(i);
    palette[i] = display.palette == Palette::copper ? copper(static_cast<double>(i) / 255.0)
                                                    : Colour{grey, grey, grey};
  }

  Picture picture{columns, rows, display.palette == Palette::copper ? 3 : 1, {}};
  const auto channels = static_cast<std::size_t>(picture.channels);
  picture.pixels.resize(rows * columns * channels);
  std::uint8_t* pixel = picture.pixels.data();
  for (std::size_t row = rows; row-- > 0;)
    for (std::size_t column = 0; column < columns; ++column) {
      const double power = waterfall.pixels.intensity[row * columns + column] * gains[column];
      const double brightness = std::min(1.0, std::pow(power, 0.5 * display.gamma));
      const Colour& colour = palette[static_cast<std::size_t>(std::lround(255.0 * brightness))];
      pixel = std::copy_n(colour.begin(), channels, pixel);
    }
  return picture;
}

}  // namespace ensonify::engine
