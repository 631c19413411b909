#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/output/attributes.h>
#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {

/// Writes the layers of a waterfall as a NumPy archive: float32 and uint32 arrays of shape (pings,
/// columns) with the names of the layers, and `attributes`, a JSON string of image_attributes().
/// Throws what `write_at` throws, std::bad_alloc, and std::runtime_error if libarchive fails.
void encode_npz(const Waterfall& waterfall, const ImageOrigin& origin,
                const refine::WriteAt& write_at);

/// A NumPy array file of float64, shape (rows, columns), C order. Throws std::invalid_argument
/// unless values.size() == rows * columns.
std::vector<std::byte> encode_npy(std::span<const double> values, std::size_t rows,
                                  std::size_t columns);

}  // namespace ensonify::engine
