#include <ensonify/engine/image/truth_picture.h>

#include <algorithm>
#include <cstddef>
#include <map>
#include <stdexcept>

namespace ensonify::engine {
namespace {

constexpr Rgb white{255, 255, 255};
constexpr Rgb no_data_colour{110, 110, 110}, water_colour{20, 60, 120},
    bed_shadow_colour{0, 130, 110}, thing_shadow_colour{190, 40, 235};
/// Strong colours for classes, pale colours for sediments.
constexpr auto class_colours = rgb_colours({0xff3c32, 0xffd700, 0x00e1eb, 0x5ae63c, 0xff8200,
                                            0xff5abe, 0x4682ff, 0xb9ff96, 0xc8965a, 0xe6e6ff});
constexpr auto sediment_colours =
    rgb_colours({0xc8b46e, 0xa5af3c, 0x7882be, 0xbe786e, 0x6eb4be, 0xb482b4});

/// How a pixel is painted, in the order of the legend.
struct Paint {
  enum class Kind { untouched, class_name, sediment, thing_shadow, bed_shadow, water, no_data };
  Kind kind = Kind::untouched;
  std::uint32_t number = 0;  // of the class or sediment
  friend auto operator<=>(const Paint&, const Paint&) = default;
};

class TruthPainter {
 public:
  TruthPainter(const Waterfall& waterfall, std::span<const std::string> classes,
               std::span<const std::string> materials)
      : layers_(waterfall.pixels), classes_(classes), materials_(materials) {
    std::uint32_t first = 0;
    for (std::size_t i = 0; i < layers_.region.size(); ++i) {
      if (!is(i, Region::seabed) || !plain(layers_.class_id[i])) continue;
      if (first == 0) first = layers_.sediment[i];
      several_ = several_ || layers_.sediment[i] != first;
    }
  }

  Paint paint(std::size_t i) const {
    using enum Paint::Kind;
    switch (static_cast<Region>(layers_.region[i])) {
      case Region::no_data: return {no_data, 0};
      case Region::water_column: return {water, 0};
      case Region::shadow: return {layers_.shadow_instance[i] != 0 ? thing_shadow : bed_shadow, 0};
      case Region::seabed:
      case Region::object: break;
    }
    if (!plain(layers_.class_id[i])) return {class_name, layers_.class_id[i]};
    return several_ ? Paint{sediment, layers_.sediment[i]} : Paint{};
  }

  /// A number for what a pixel shows: an object or feature (odd), a shadow of one (even), 0: none.
  std::uint64_t thing(std::size_t i) const {
    if (is(i, Region::shadow)) return 2 * std::uint64_t{layers_.shadow_instance[i]};
    const bool lit = is(i, Region::seabed) || is(i, Region::object);
    return lit && layers_.instance[i] != 0 ? 2 * std::uint64_t{layers_.instance[i]} + 1 : 0;
  }

  LegendEntry entry(const Paint& paint) const {
    const auto name = [&](std::span<const std::string> names) {
      return paint.number < names.size() ? names[paint.number] : std::to_string(paint.number);
    };
    // Class 1 is usually the seabed, which has no colour.
    switch (paint.kind) {
      case Paint::Kind::class_name:
        return {class_colours[(paint.number + class_colours.size() - 2) % class_colours.size()],
                name(classes_)};
      case Paint::Kind::sediment:
        return {sediment_colours[(paint.number + sediment_colours.size() - 1) %
                                 sediment_colours.size()],
                name(materials_)};
      case Paint::Kind::thing_shadow:
        return {thing_shadow_colour, std::string(name_of(Region::shadow))};
      case Paint::Kind::bed_shadow:
        return {bed_shadow_colour, std::string(name_of(Region::shadow)) + " of the bed"};
      case Paint::Kind::water: return {water_colour, std::string(name_of(Region::water_column))};
      case Paint::Kind::no_data: return {no_data_colour, std::string(name_of(Region::no_data))};
      case Paint::Kind::untouched: break;
    }
    return {};
  }

 private:
  bool is(std::size_t i, Region region) const {
    return layers_.region[i] == static_cast<std::uint32_t>(region);
  }
  bool plain(std::uint32_t class_id) const {
    return class_id == 0 || (class_id < classes_.size() && classes_[class_id] == "seabed");
  }

  const BinLayers& layers_;
  std::span<const std::string> classes_, materials_;
  bool several_ = false;  // plain seabed has several sediments
};

}  // namespace

TruthPicture lay_truth(const Waterfall& waterfall, const Picture& picture,
                       std::span<const std::string> classes, std::span<const std::string> materials,
                       PictureColumns picture_columns) {
  const std::size_t columns = waterfall.columns(), rows = waterfall.rows(), width = picture.width;
  if (width != picture_columns.layout(waterfall.sonar).columns() || picture.height != rows)
    throw std::invalid_argument("lay_truth: the picture's size is not the waterfall's");
  const TruthPainter painter(waterfall, classes, materials);
  const auto channels = static_cast<std::size_t>(picture.channels);
  TruthPicture truth{{width, rows, 3, std::vector<std::uint8_t>(3 * width * rows)}, {}};
  std::map<Paint, LegendEntry> legend;
  for (std::size_t row = 0; row < rows; ++row) {
    const std::size_t layers_row = rows - 1 - row;  // layers begin with the oldest
    const std::vector<ShownColumns> shown = shown_columns(waterfall, layers_row, picture_columns);
    const auto is_border = [&](std::size_t column, std::uint64_t thing) {
      const std::size_t i = layers_row * columns + column;
      return painter.thing(i) == thing &&
             ((column > 0 && painter.thing(i - 1) != thing) ||
              (column + 1 < columns && painter.thing(i + 1) != thing) ||
              (row > 0 && painter.thing(i + columns) != thing) ||
              (row + 1 < rows && painter.thing(i - columns) != thing));
    };
    for (std::size_t pixel = 0; pixel < width; ++pixel) {
      const std::uint8_t* from = &picture.pixels[channels * (row * width + pixel)];
      std::uint8_t* to = &truth.picture.pixels[3 * (row * width + pixel)];
      Paint paint;
      bool border = false;
      const std::ptrdiff_t labelled = labelled_column(waterfall, layers_row, shown[pixel]);
      if (labelled >= 0) {
        const std::size_t i = layers_row * columns + static_cast<std::size_t>(labelled);
        paint = painter.paint(i);
        if (const std::uint64_t thing = painter.thing(i); thing != 0)
          for (std::size_t c = shown[pixel].first(); c < shown[pixel].end(); ++c)
            border = border || is_border(c, thing);
      }
      if (paint.kind != Paint::Kind::untouched && !legend.contains(paint))
        legend[paint] = painter.entry(paint);
      for (std::size_t k = 0; k < 3; ++k) {
        const int grey = from[channels == 3 ? k : 0];
        const int tint = paint.kind == Paint::Kind::untouched ? grey : legend[paint].colour[k];
        // The tint is mixed in, not multiplied: shadows and water are dark and must show it too.
        to[k] = static_cast<std::uint8_t>(border ? (grey + 3 * tint) / 4 : (grey + tint) / 2);
      }
    }
  }
  for (const auto& [paint, entry] : legend) truth.legend.push_back(entry);
  return truth;
}

Picture with_legend(const TruthPicture& truth) {
  const Picture& above = truth.picture;
  const std::size_t size = std::max<std::size_t>(1, above.width / 600);
  const std::size_t line = size * (letter_height_px + 4), swatch = size * letter_height_px;
  struct Place {
    std::size_t left, top;
  };
  std::vector<Place> places;
  std::size_t left = 0, top = 0;
  for (const LegendEntry& entry : truth.legend) {
    const std::size_t width = swatch + size * letter_width_px * (entry.name.size() + 2);
    if (left > 0 && left + width > above.width) {
      left = 0;
      top += line;
    }
    places.push_back({left + 2 * size, above.height + top + 2 * size});
    left += width;
  }
  Picture whole = above;
  whole.height += truth.legend.empty() ? 0 : top + line;
  whole.pixels.resize(3 * whole.width * whole.height, 0);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto [x, y] = places[i];
    for (std::size_t row = y; row < y + swatch - size; ++row)
      for (std::size_t column = x; column < std::min(x + swatch, whole.width); ++column)
        std::copy_n(truth.legend[i].colour.begin(), 3,
                    &whole.pixels[3 * (row * whole.width + column)]);
    write_text(whole, x + swatch + 3 * size, y, size, white, truth.legend[i].name);
  }
  return whole;
}

}  // namespace ensonify::engine
