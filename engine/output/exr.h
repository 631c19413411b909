#pragma once

#include <cstddef>
#include <vector>

#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/output/attributes.h>

namespace ensonify::engine {

/// All layers of a waterfall as one OpenEXR image: FLOAT and UINT channels named as the layers,
/// losslessly compressed, with the attributes of image_attributes. The same bytes at any thread
/// count. Throws std::invalid_argument for a waterfall without pixels.
std::vector<std::byte> encode_exr(const Waterfall& waterfall, const ImageOrigin& origin);

}  // namespace ensonify::engine
