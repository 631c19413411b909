#pragma once

#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/output/attributes.h>
#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {

/// Writes the layers of a waterfall as one OpenEXR image, with the attributes of
/// image_attributes(). The FLOAT and UINT channels have the names of the layers and are compressed
/// without loss. The origin's preview is the HALF channel Y, a linear luminance from 0 to 1, which
/// viewers show as a grey picture. The bytes do not depend on the number of threads. Throws
/// std::invalid_argument if the waterfall has no pixels, and what `write_at` throws.
void encode_exr(const Waterfall& waterfall, const ImageOrigin& origin,
                const refine::WriteAt& write_at);

/// Sets the number of threads for ZIP and PIZ compression, which all calls of encode_exr() in this
/// process share. The default is one.
void set_exr_threads(int threads);

}  // namespace ensonify::engine
