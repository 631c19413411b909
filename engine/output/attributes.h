#pragma once

#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/image/label_names.h>
#include <ensonify/engine/image/waterfall.h>

namespace ensonify::engine {

/// What an image file has of its origin, in addition to its layers.
struct ImageOrigin {
  Eigen::Vector3d world_origin =
      Eigen::Vector3d::Zero();  ///< world = world_origin + (x_m, y_m, z_m)
  std::string scene_hash;
  LabelNames names;  ///< of its labels
};

/// A named fact that goes into an image file.
struct Attribute {
  std::string name;
  std::variant<std::string, double, int, std::vector<std::string>> value;
};

/// What every image file has in addition to its layers: row_order, sonar, frequency_hz, range_m,
/// bins, full_scale (of a sample), world_origin_x_m, _y_m, _z_m, scene_hash, class_names and
/// sediment_names (index k is number k of the layer), `sides` (port or starboard) of a sonar that
/// has one, and units_LAYER for every layer.
std::vector<Attribute> image_attributes(const Waterfall& waterfall, const ImageOrigin& origin);

}  // namespace ensonify::engine
