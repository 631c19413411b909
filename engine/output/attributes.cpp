#include <ensonify/engine/output/attributes.h>

#include <fmt/format.h>

namespace ensonify::engine {
namespace {

std::string units(std::string_view layer) {
  if (layer.starts_with("intensity")) return "uPa^2";
  if (layer == "sample") return "1 over full_scale, after gain and transfer curve";
  if (layer.ends_with("_m")) return "m";
  if (layer.ends_with("_rad")) return "rad";
  if (layer.ends_with("fraction")) return "1";
  if (layer == "region") {
    std::string numbers;
    for (std::size_t i = 0; i < region_names.size(); ++i)
      numbers += fmt::format("{}{} {}", i == 0 ? "" : ", ", i, region_names[i]);
    return numbers;
  }
  if (layer == "layover") return "0 no, 1 yes";
  return "number, 0 is none";
}

}  // namespace

std::vector<Attribute> image_attributes(const Waterfall& waterfall, const ImageOrigin& origin) {
  const Sonar& sonar = waterfall.sonar;
  std::vector<Attribute> attributes = {
      {"row_order", "oldest_first"},
      {"sonar", sonar.name},
      {"frequency_hz", sonar.frequency_hz},
      {"range_m", sonar.range_m},
      {"bins", sonar.bins},
      {"full_scale", (1 << sonar.receiver.bits) - 1},
      {"world_origin_x_m", origin.world_origin.x()},
      {"world_origin_y_m", origin.world_origin.y()},
      {"world_origin_z_m", origin.world_origin.z()},
      {"scene_hash", origin.scene_hash},
      {"class_names", origin.names.classes},
      {"sediment_names", origin.names.materials},
  };
  if (sonar.sides != Sides::both)
    attributes.push_back({"sides", std::string(name_of(sonar.sides))});
  if (waterfall.rows() > 0 && waterfall.pings.front().number > 0)
    attributes.push_back({"first_ping", static_cast<int>(waterfall.pings.front().number)});
  BinLayers::for_each([&](std::string_view layer, auto) {
    if (origin.has_layer(layer))
      attributes.push_back({"units_" + std::string(layer), units(layer)});
  });
  return attributes;
}

}  // namespace ensonify::engine
