#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/output/exr.h>

namespace ensonify::engine {

/// All layers of a waterfall as a NumPy archive: float32 and uint32 arrays of shape (pings, columns),
/// named as the layers, and `attributes`, a JSON string of the EXR's attributes.
std::vector<std::byte> encode_npz(const Waterfall& waterfall, const ImageOrigin& origin);

/// A NumPy array file of float64, shape (rows, columns), C order. values.size() == rows * columns.
std::vector<std::byte> encode_npy(std::span<const double> values, std::size_t rows, std::size_t columns);

}  // namespace ensonify::engine
