// Runs scenes and writes a small picture of each: the display next to the truth, both to one scale
// in both directions. ./dev gallery calls it.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <png.h>

#include <ensonify/engine/image/fan_picture.h>
#include <ensonify/engine/image/lettering.h>
#include <ensonify/engine/image/truth_picture.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/simulator/ping_all.h>
#include <ensonify/engine/simulator/prepare.h>
#include <ensonify/refine/atomic_file.h>

namespace {

namespace fs = std::filesystem;
using namespace ensonify;
using namespace ensonify::engine;

constexpr std::size_t fan_px = 240;  // height of a fan
constexpr double side_px = 290.0;    // of a square picture; others have as many pixels
constexpr std::size_t max_colours = 64;

/// Each new pixel is the mean of the pixels that it covers.
Picture resampled(const Picture& from, std::size_t width, std::size_t height) {
  Picture to{width, height, 3, std::vector<std::uint8_t>(3 * width * height)};
  const auto channels = static_cast<std::size_t>(from.channels);
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t left = x * from.width / width, top = y * from.height / height;
      const std::size_t right = std::max(left + 1, (x + 1) * from.width / width);
      const std::size_t bottom = std::max(top + 1, (y + 1) * from.height / height);
      std::array<double, 3> sum{};
      for (std::size_t row = top; row < bottom; ++row)
        for (std::size_t column = left; column < right; ++column)
          for (std::size_t k = 0; k < 3; ++k)
            sum[k] += from.pixels[channels * (row * from.width + column) + (channels == 3 ? k : 0)];
      for (std::size_t k = 0; k < 3; ++k)
        to.pixels[3 * (y * width + x) + k] = static_cast<std::uint8_t>(
            std::lround(sum[k] / static_cast<double>((right - left) * (bottom - top))));
    }
  return to;
}

Picture side_by_side(const Picture& a, const Picture& b) {
  constexpr std::size_t gap = 4;
  Picture both{a.width + gap + b.width, a.height, 3, {}};
  both.pixels.resize(3 * both.width * both.height, 255);
  for (std::size_t y = 0; y < a.height; ++y) {
    std::uint8_t* row = &both.pixels[3 * y * both.width];
    std::copy_n(&a.pixels[3 * y * a.width], 3 * a.width, row);
    std::copy_n(&b.pixels[3 * y * b.width], 3 * b.width, row + 3 * (a.width + gap));
  }
  return both;
}

/// Reduces a picture to a palette: its most frequent colours, and the legend's colours blended with
/// darker and brighter greys.
std::vector<std::byte> palette_png(const Picture& picture, std::span<const LegendEntry> legend) {
  struct Sum {
    std::array<std::size_t, 3> rgb{};
    std::size_t count = 0;
  };
  std::map<int, Sum> sums;  // by the upper five bits of each channel
  const std::size_t pixels = picture.width * picture.height;
  for (std::size_t i = 0; i < pixels; ++i) {
    const std::uint8_t* p = &picture.pixels[3 * i];
    Sum& sum = sums[(p[0] >> 3) << 10 | (p[1] >> 3) << 5 | p[2] >> 3];
    for (std::size_t k = 0; k < 3; ++k) sum.rgb[k] += p[k];
    ++sum.count;
  }
  std::vector<Sum> most;
  for (const auto& [key, sum] : sums) most.push_back(sum);
  std::ranges::stable_sort(most, [](const Sum& a, const Sum& b) { return a.count > b.count; });
  if (most.size() > max_colours) most.resize(max_colours);
  std::vector<std::uint8_t> palette, indices;
  for (const Sum& sum : most)
    for (const std::size_t channel : sum.rgb)
      palette.push_back(static_cast<std::uint8_t>(channel / sum.count));
  for (const LegendEntry& entry : legend)
    for (const auto& [part, grey] : {std::pair{4, 0}, {3, 50}, {2, 0}, {2, 70}, {2, 150}})
      for (const int channel : entry.colour)
        palette.push_back(static_cast<std::uint8_t>((part * channel + (4 - part) * grey) / 4));
  palette.insert(palette.end(), 3, 255);
  const std::size_t colours = palette.size() / 3;
  for (std::size_t i = 0; i < pixels; ++i) {
    std::size_t nearest = 0;
    int least = 1 << 30;
    for (std::size_t c = 0; c < colours; ++c) {
      int distance = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const int apart = picture.pixels[3 * i + k] - palette[3 * c + k];
        distance += apart * apart;
      }
      if (distance < least) {
        least = distance;
        nearest = c;
      }
    }
    indices.push_back(static_cast<std::uint8_t>(nearest));
  }
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = PNG_FORMAT_RGB_COLORMAP;
  image.colormap_entries = static_cast<png_uint_32>(colours);
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::vector<std::byte> bytes(size);
  if (!png_image_write_to_memory(&image, bytes.data(), &size, 0, indices.data(), 0, palette.data()))
    throw std::runtime_error(image.message);
  bytes.resize(size);
  return bytes;
}

/// Draws a bar of 1, 2 or 5 times a power of ten metres, at most a third of the picture long, with
/// its length, into the lower left corner.
void add_scale_bar(Picture& picture, double px_per_m) {
  const double longest_m = static_cast<double>(picture.width) / 3.0 / px_per_m;
  const double decade_m = std::pow(10.0, std::floor(std::log10(longest_m)));
  const double length_m = decade_m * (longest_m >= 5.0 * decade_m   ? 5.0
                                      : longest_m >= 2.0 * decade_m ? 2.0
                                                                    : 1.0);
  constexpr std::size_t margin = 6, thickness = 3;
  constexpr Rgb black{0, 0, 0}, white{255, 255, 255};
  const std::string text = fmt::format("{:g} m", length_m);
  const auto length = static_cast<std::size_t>(std::lround(length_m * px_per_m));
  const std::size_t label = letter_width_px * text.size();
  const std::size_t bottom = picture.height - margin;
  const std::size_t box_top = bottom - thickness - letter_height_px - 6;
  const auto fill = [&](std::size_t left, std::size_t top, std::size_t right, std::size_t end,
                        const Rgb& colour) {
    for (std::size_t y = top; y < std::min(end, picture.height); ++y)
      for (std::size_t x = left; x < std::min(right, picture.width); ++x)
        std::ranges::copy(colour, &picture.pixels[3 * (y * picture.width + x)]);
  };
  fill(margin - 3, box_top, margin + std::max(length, label) + 3, bottom + 3, black);
  write_text(picture, margin, box_top + 3, 1, white, text);
  fill(margin, bottom - thickness, margin + length, bottom, white);
}

/// Mean distance from ping to ping, in metres.
double ping_step_m(const Waterfall& image) {
  double way_m = 0.0;
  for (std::size_t i = 1; i < image.pings.size(); ++i)
    way_m += (image.pings[i].pose.position - image.pings[i - 1].pose.position).head<2>().norm();
  return way_m / static_cast<double>(image.pings.size() - 1);
}

void picture_scene(const fs::path& file, const fs::path& folder) {
  const char* data = std::getenv("ENSONIFY_DATA");
  const Scene scene = read_scene(file, {}, data ? data : "");
  Simulator simulator(scene, {.cache = default_cache()});
  const ScenePings pings = ping_all(scene, simulator, 0);
  const Waterfall& image = pings.images.front();
  const double ratio = ping_step_m(image) * static_cast<double>(image.rows()) /
                       (image.sonar.bin_m() * static_cast<double>(image.columns()));
  const auto width = static_cast<std::size_t>(std::lround(side_px / std::sqrt(ratio)));
  const auto height = static_cast<std::size_t>(std::lround(side_px * std::sqrt(ratio)));
  const Picture picture = render(image, scene.display, simulator.calibration(0));
  TruthPicture truth = lay_truth(
      image, picture, simulator.classes(), simulator.materials(),
      picture_columns(image.sonar, scene.display, simulator.calibration(0).row_spacing_m));
  if (image.sonar.steers()) {  // the first ping
    const FanPicture fan(image.sonar);
    const auto small = [&](const Picture& of) {
      const Picture first = fan.draw(of, 0);
      return resampled(first, fan_px * first.width / first.height, fan_px);
    };
    Picture shown = small(picture);
    add_scale_bar(shown, static_cast<double>(fan_px) / image.sonar.range_m);
    truth.picture = side_by_side(shown, small(truth.picture));
  } else {
    Picture shown = resampled(picture, width, height);
    add_scale_bar(shown, static_cast<double>(height) /
                             (ping_step_m(image) * static_cast<double>(image.rows())));
    truth.picture = side_by_side(shown, resampled(truth.picture, width, height));
  }
  const fs::path to = folder / (file.stem().string() + ".png");
  const std::vector<std::byte> bytes = palette_png(with_legend(truth), truth.legend);
  refine::write_file(to, bytes);
  fmt::print("{} ({} kB)\n", to.string(), bytes.size() / 1000);
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 3) {
    fmt::print(stderr, "usage: ensonify-gallery FOLDER SCENE.toml...\n");
    return 2;
  }
  try {
    fs::create_directories(arguments[1]);
    for (int i = 2; i < count; ++i) picture_scene(arguments[i], arguments[1]);
  } catch (const std::exception& error) {
    fmt::print(stderr, "ensonify-gallery: {}\n", error.what());
    return 1;
  }
  return 0;
}
