#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/image/waterfall.h>

namespace ensonify::engine {

inline constexpr std::uint16_t ignored_class = 255;  ///< also of sediment masks
inline constexpr std::uint16_t ignored_instance = 65535;

/// Numbers of a waterfall's own labels in the masks of a dataset.
struct MaskNumbers {
  std::vector<std::uint16_t> classes, sediments;  ///< by their numbers in the layers
  std::vector<std::uint32_t> ignored;             ///< instances that are left out
};

/// A label picture: newest ping on top.
struct Mask {
  std::string name;  ///< class, sediment, instance or region
  std::vector<std::byte> png;
};

/// What each pixel of a waterfall's picture belongs to. class: of bed and objects, 0 elsewhere, 255 without data
/// and on ignored objects; sediment: of bed and objects, 255 elsewhere; instance: of objects and of the bed's features (16 bits), 65535
/// without data and on ignored ones; region: its number. Throws std::invalid_argument for a label without a number.
std::vector<Mask> encode_masks(const Waterfall& waterfall, const MaskNumbers& numbers);

}  // namespace ensonify::engine
