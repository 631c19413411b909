#pragma once

#include <algorithm>
#include <functional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/image/label_names.h>
#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/output/layer_encoding.h>

namespace ensonify::engine {

/// What a file of layers needs in addition to its waterfall.
struct ImageOrigin {
  /// World coordinates = world_origin + (x_m, y_m, z_m).
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();
  std::string scene_hash;
  LabelNames names;  ///< of the image's classes and sediments
  LayerEncoding encoding = {};
  /// Makes the preview in an EXR, a grey picture of 8 bits with the image's pixels; empty: none.
  std::function<Picture()> preview = {};

  bool has_layer(std::string_view name) const {
    return encoding.layers.empty() ||
           std::ranges::find(encoding.layers, name) != encoding.layers.end();
  }
};

/// One attribute of an image file.
struct Attribute {
  std::string name;
  std::variant<std::string, double, int, std::vector<std::string>> value;
};

/// The attributes of every image file: row_order, sonar, frequency_hz, range_m, bins, full_scale
/// (of a sample), world_origin_x_m, _y_m, _z_m, scene_hash, class_names and sediment_names (entry k
/// names number k of the layer), `sides` (unless the sonar has both sides), `first_ping` (unless it
/// is 0, in a later part of a run), and units_LAYER for every layer of the file.
std::vector<Attribute> image_attributes(const Waterfall& waterfall, const ImageOrigin& origin);

}  // namespace ensonify::engine
