#pragma once

#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/output/attributes.h>
#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {

/// All layers of a waterfall as one OpenEXR image: FLOAT and UINT channels named as the layers,
/// compressed without loss, with the attributes of image_attributes(); and the origin's preview as
/// the HALF channel Y, linear luminance from 0 to 1, which viewers show as a grey picture. The
/// bytes do not depend on the number of threads. Throws std::invalid_argument if the waterfall has
/// no pixels, and what `write_at` throws.
void encode_exr(const Waterfall& waterfall, const ImageOrigin& origin,
                const refine::WriteAt& write_at);

/// The number of threads that encode_exr() may use for ZIP and PIZ compression in this process, all
/// calls together. At first it is one.
void set_exr_threads(int threads);

}  // namespace ensonify::engine
