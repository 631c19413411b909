#include <ensonify/engine/output/masks.h>

#include <algorithm>
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

}  // namespace

std::vector<Mask> encode_masks(const Waterfall& waterfall, const MaskNumbers& numbers) {
  const Layers& layers = waterfall.pixels;
  const std::size_t rows = waterfall.rows(), columns = waterfall.columns();
  const auto number = [](const std::vector<std::uint16_t>& of, std::uint32_t label) {
    if (label >= of.size()) throw std::invalid_argument("encode_masks: a label without a number");
    return of[label];
  };
  std::vector<std::uint16_t> classes(rows * columns), sediments(classes), instances(classes),
      regions(classes);
  for (std::size_t i = 0; i < classes.size(); ++i) {
    const std::size_t from = (rows - 1 - i / columns) * columns + i % columns;
    const auto region = static_cast<Region>(layers.region[from]);
    const bool seen = region == Region::object || region == Region::seabed;
    const bool ignored = seen && std::ranges::count(numbers.ignored, layers.instance[from]) > 0;
    const bool unknown = region == Region::no_data || ignored;
    regions[i] = static_cast<std::uint16_t>(region);
    classes[i] = unknown ? ignored_class
                 : seen  ? number(numbers.classes, layers.class_id[from])
                         : std::uint16_t{0};
    sediments[i] =
        seen && !ignored ? number(numbers.sediments, layers.sediment[from]) : ignored_class;
    instances[i] = unknown ? ignored_instance
                   : seen  ? static_cast<std::uint16_t>(layers.instance[from])
                           : std::uint16_t{0};
  }
  return {{"class", encode_png8(waterfall, classes)},
          {"sediment", encode_png8(waterfall, sediments)},
          {"instance", encode_png16(columns, instances)},
          {"region", encode_png8(waterfall, regions)}};
}

}  // namespace ensonify::engine
