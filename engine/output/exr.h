#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/image/waterfall.h>

namespace ensonify::engine {

/// What an image file says of its origin, beside its layers.
struct ImageOrigin {
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();  ///< world = world_origin + (x_m, y_m, z_m)
  std::string scene_hash;
};

/// All layers of a waterfall as one OpenEXR image, FLOAT and UINT channels named as the layers,
/// losslessly compressed. Attributes: row_order, units, sonar (and its numbers), world_origin_x_m …,
/// scene_hash. The same bytes at any thread count.
std::vector<std::byte> encode_exr(const Waterfall& waterfall, const ImageOrigin& origin);

}  // namespace ensonify::engine
