#include <ensonify/engine/output/masks.h>

#include <algorithm>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/output/png.h>

namespace ensonify::engine {
namespace {

std::vector<std::byte> encode_png8(const Waterfall& waterfall,
                                   std::span<const std::uint16_t> numbers,
                                   std::span<const std::string> names) {
  Picture picture{waterfall.columns(), waterfall.rows(), 1, {}};
  picture.pixels.assign(numbers.begin(), numbers.end());
  const nlohmann::json list = std::vector<std::string>(names.begin(), names.end());
  return encode_png(picture, {{"names", ascii_json_text(list)}});
}

std::vector<std::uint16_t> numbers_in(std::span<const std::uint16_t> pixels) {
  std::vector<char> there(pixels.empty() ? 0 : std::ranges::max(pixels) + std::size_t{1});
  for (const std::uint16_t pixel : pixels) there[pixel] = 1;
  std::vector<std::uint16_t> numbers;
  for (std::size_t i = 0; i < there.size(); ++i)
    if (there[i]) numbers.push_back(static_cast<std::uint16_t>(i));
  return numbers;
}

}  // namespace

Masks encode_masks(const Waterfall& waterfall, const MaskOptions& options) {
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
  const auto is_ignored = [&](std::uint32_t instance) {
    return std::ranges::count(options.ignored, instance) > 0;
  };
  std::size_t i = 0;
  for (std::size_t row = rows; row-- > 0;)
    for (std::size_t from = row * columns; from < (row + 1) * columns; ++from, ++i) {
      const auto region = static_cast<Region>(layers.region[from]);
      const bool seen = region == Region::object || region == Region::seabed;
      const bool left_out = seen && is_ignored(layers.instance[from]);
      const bool unknown = region == Region::no_data || left_out;
      const std::uint32_t shadow_of =
          region == Region::shadow && options.shadow_class > 0 ? layers.shadow_instance[from] : 0;
      regions[i] = static_cast<std::uint16_t>(region);
      classes[i] = unknown                 ? ignored_class
                   : seen                  ? number(layers.class_id[from])
                   : shadow_of == 0        ? std::uint16_t{0}
                   : is_ignored(shadow_of) ? ignored_class
                                           : options.shadow_class;
      sediments[i] = seen && !left_out ? number(layers.sediment[from]) : ignored_class;
      instances[i] = unknown ? ignored_instance
                     : seen  ? static_cast<std::uint16_t>(layers.instance[from])
                             : std::uint16_t{0};
    }
  const std::vector<std::string> names_of_regions(region_names.begin(), region_names.end());
  return {{{"class", encode_png8(waterfall, classes, options.names.classes)},
           {"sediment", encode_png8(waterfall, sediments, options.names.materials)},
           {"instance", encode_png16(columns, instances)},
           {"region", encode_png8(waterfall, regions, names_of_regions)}},
          numbers_in(classes)};
}

}  // namespace ensonify::engine
