#include <ensonify/engine/output/masks.h>

#include <algorithm>
#include <limits>
#include <stdexcept>

#include <ensonify/engine/output/png.h>

namespace ensonify::engine {
namespace {

std::vector<std::byte> encode_png8(const Waterfall& waterfall,
                                   std::span<const std::uint16_t> numbers) {
  Picture picture{waterfall.columns(), waterfall.rows(), 1, {}};
  picture.pixels.assign(numbers.begin(), numbers.end());
  return encode_png(picture);
}

std::vector<std::uint16_t> numbers_in(std::span<const std::uint16_t> pixels) {
  std::vector<bool> there(std::numeric_limits<std::uint16_t>::max() + 1);
  for (const std::uint16_t pixel : pixels) there[pixel] = true;
  std::vector<std::uint16_t> numbers;
  for (std::size_t i = 0; i < there.size(); ++i)
    if (there[i]) numbers.push_back(static_cast<std::uint16_t>(i));
  return numbers;
}

}  // namespace

std::vector<Mask> encode_masks(const Waterfall& waterfall, std::span<const std::uint32_t> ignored) {
  const BinLayers& layers = waterfall.pixels;
  const std::size_t rows = waterfall.rows(), columns = waterfall.columns();
  const auto number = [](std::uint32_t label) {
    if (label >= ignored_class)
      throw std::invalid_argument(
          "encode_masks: a class or sediment above 254 does not fit 8 bits");
    return static_cast<std::uint16_t>(label);
  };
  std::vector<std::uint16_t> classes(rows * columns), sediments(classes), instances(classes),
      regions(classes);
  for (std::size_t i = 0; i < classes.size(); ++i) {
    const std::size_t from = (rows - 1 - i / columns) * columns + i % columns;
    const auto region = static_cast<Region>(layers.region[from]);
    const bool seen = region == Region::object || region == Region::seabed;
    const bool left_out = seen && std::ranges::count(ignored, layers.instance[from]) > 0;
    const bool unknown = region == Region::no_data || left_out;
    regions[i] = static_cast<std::uint16_t>(region);
    classes[i] = unknown ? ignored_class : seen ? number(layers.class_id[from]) : std::uint16_t{0};
    sediments[i] = seen && !left_out ? number(layers.sediment[from]) : ignored_class;
    instances[i] = unknown ? ignored_instance
                   : seen  ? static_cast<std::uint16_t>(layers.instance[from])
                           : std::uint16_t{0};
  }
  return {{"class", encode_png8(waterfall, classes), numbers_in(classes)},
          {"sediment", encode_png8(waterfall, sediments), numbers_in(sediments)},
          {"instance", encode_png16(columns, instances), numbers_in(instances)},
          {"region", encode_png8(waterfall, regions), numbers_in(regions)}};
}

}  // namespace ensonify::engine
