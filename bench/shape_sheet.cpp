// Draws each family of shapes as the sonar sees it: a sheet of 36 views, one row per form (the seed
// of the shape) and one column per azimuth. ./dev shapes calls it.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <png.h>

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/seafloor/objects/shapes.h>
#include <ensonify/engine/simulator/ping_all.h>
#include <ensonify/engine/simulator/prepare.h>
#include <ensonify/refine/atomic_file.h>
#include <ensonify/scatter/sea_water.h>

namespace {

namespace fs = std::filesystem;
using namespace ensonify;
using namespace ensonify::engine;

constexpr int forms = 6, azimuths = 6;
constexpr std::size_t chip_px = 160, gap_px = 3;

/// What a view shows across, in metres: the object and its shadow.
double view_m(const refine::TriangleMesh& mesh) {
  const refine::Bounds box = refine::bounds(mesh);
  const Eigen::Vector3f size = box.highest - box.lowest;
  return 1.6 * static_cast<double>(size.head<2>().norm() + size.z());
}

/// A scene with one object in its middle, which the sonar passes at twice the view's width.
std::string scene_of(std::string_view shape, double view_m, int seed, double heading_deg,
                     std::string_view keys) {
  const double bin_m = view_m / static_cast<double>(chip_px), range_m = 2.6 * view_m;
  const double frequency_hz = range_m > 250.0 ? 120e3 : range_m > 60.0 ? 400e3 : 900e3;
  // A beam as wide as a pixel.
  const double array_m = scatter::nominal_sound_speed_mps / frequency_hz * 1.5 * view_m / bin_m;
  return fmt::format(
      R"(version = 1
seed = {seed}
[seafloor]
kind = "fractal"
extent_east_m = {east}
extent_north_m = {north}
cell_m = {cell}
depth_m = {depth}
material = "medium sand"
[seafloor.fractal]
height_at_1m_m = 0.006
hurst = 0.7
[[objects]]
shape = "{shape}"
shape_seed = {seed}
class = "{shape}"
heading_deg = {heading}
{keys}
[track]
pings = {pings}
speed_mps = 1
ping_interval_s = {bin}
altitude_m = {altitude}
heading_deg = 0
middle_east_m = {across}
[sonar.sidescan]
sides = "starboard"
frequency_hz = {frequency}
bandwidth_hz = {bandwidth}
array_length_m = {array}
focused = true
range_m = {range}
bins = {bins}
)",
      fmt::arg("seed", seed), fmt::arg("east", 3.2 * view_m), fmt::arg("north", 2.2 * view_m),
      fmt::arg("cell", view_m / 200.0), fmt::arg("depth", 0.6 * view_m + 5.0),
      fmt::arg("shape", shape), fmt::arg("heading", heading_deg), fmt::arg("keys", keys),
      fmt::arg("pings", chip_px), fmt::arg("bin", bin_m), fmt::arg("altitude", 0.3 * view_m),
      fmt::arg("across", -1.5 * view_m), fmt::arg("frequency", frequency_hz),
      fmt::arg("bandwidth", 750.0 / bin_m), fmt::arg("array", array_m), fmt::arg("range", range_m),
      fmt::arg("bins", static_cast<int>(range_m / bin_m)));
}

struct Sheet {
  std::size_t width = azimuths * (chip_px + gap_px) - gap_px;
  std::size_t height = forms * (chip_px + gap_px) - gap_px;
  std::vector<std::uint8_t> pixels = std::vector<std::uint8_t>(width * height, 255);

  /// Copies the part of a picture that begins at a column.
  void put(const Picture& picture, std::size_t from, std::size_t row, std::size_t column) {
    for (std::size_t y = 0; y < std::min(chip_px, picture.height); ++y)
      for (std::size_t x = 0; x < std::min(chip_px, picture.width - from); ++x)
        pixels[(row * (chip_px + gap_px) + y) * width + column * (chip_px + gap_px) + x] =
            picture.pixels[static_cast<std::size_t>(picture.channels) *
                           (y * picture.width + from + x)];
  }

  std::vector<std::byte> png() const {
    png_image image = {};
    image.version = PNG_IMAGE_VERSION;
    image.width = static_cast<png_uint_32>(width);
    image.height = static_cast<png_uint_32>(height);
    image.format = PNG_FORMAT_GRAY;
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
    std::vector<std::byte> bytes(size);
    if (!png_image_write_to_memory(&image, bytes.data(), &size, 0, pixels.data(), 0, nullptr))
      throw std::runtime_error(image.message);
    bytes.resize(size);
    return bytes;
  }
};

/// Rows go through the variants, if none is asked for.
void draw(const ShapeKind& kind, const std::string& asked, const fs::path& file) {
  Sheet sheet;
  std::size_t faces = 0;
  double making_s = 0.0;
  for (int form = 0; form < forms; ++form) {
    const std::string variant =
        !asked.empty() || kind.variants.empty()
            ? asked
            : std::string(kind.variants[static_cast<std::size_t>(form) % kind.variants.size()]);
    const std::string keys = variant.empty() ? "" : fmt::format("variant = \"{}\"", variant);
    const auto begun = std::chrono::steady_clock::now();
    const RandomStream random(static_cast<std::uint64_t>(form + 1), Purpose::object_shape, {0, 0});
    const refine::TriangleMesh mesh = make_body(kind, {}, random, variant).mesh;
    const double wide_m = view_m(mesh);
    faces += mesh.faces.size();
    making_s += std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
    for (int azimuth = 0; azimuth < azimuths; ++azimuth) {
      const double heading_deg = 60.0 * azimuth + 10.0 * form;
      const Scene scene = parse_scene(scene_of(kind.name, wide_m, form + 1, heading_deg, keys),
                                      std::string(kind.name), {}, {});
      Simulator simulator(scene, {.cache = {}});
      const ScenePings pings = ping_all(scene, simulator, 0);
      const Picture picture = render(pings.images.front(), scene.display, simulator.calibration(0));
      // The object's slant range, in a picture whose left is the vehicle's track.
      const auto from =
          static_cast<std::size_t>((std::hypot(1.5, 0.3) - 0.4) * static_cast<double>(chip_px));
      sheet.put(picture, from, static_cast<std::size_t>(form), static_cast<std::size_t>(azimuth));
    }
  }
  refine::write_file(file, sheet.png());
  fmt::print("{}: {} faces, {:.1f} ms to make (means of {})\n", file.string(), faces / forms,
             1e3 * making_s / forms, forms);
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 2) {
    fmt::print(stderr, "usage: ensonify-shape-sheet FOLDER [SHAPE | SHAPE:VARIANT]...\n");
    return 2;
  }
  try {
    const fs::path folder = arguments[1];
    fs::create_directories(folder);
    std::vector<std::string> names(arguments + 2, arguments + count);
    if (names.empty())
      for (const ShapeKind& kind : shape_kinds())
        if (kind.family) names.emplace_back(kind.name);
    for (const std::string& name : names) {
      const std::size_t colon = std::min(name.find(':'), name.size());
      const std::string shape = name.substr(0, colon);
      const std::string variant = colon < name.size() ? name.substr(colon + 1) : "";
      if (variant.empty())
        draw(shape_named(shape), "", folder / (shape + ".png"));
      else
        draw(shape_named(shape), variant, folder / fmt::format("{}_{}.png", shape, variant));
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "ensonify-shape-sheet: {}\n", error.what());
    return 1;
  }
  return 0;
}
