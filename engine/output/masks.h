#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/seafloor/seafloor.h>

namespace ensonify::engine {

inline constexpr std::uint16_t ignored_class = 255;  ///< also in sediment masks
inline constexpr std::uint16_t ignored_instance = max_labels;

/// A picture of labels, the newest ping on top.
struct Mask {
  std::string name;  ///< class, sediment, instance or region
  std::vector<std::byte> png;
  std::vector<std::uint16_t> numbers;  ///< the values of its pixels, each once, ascending
};

/// Four masks of a waterfall's picture, with the numbers of its layers.
/// class: of bed and objects; 0 elsewhere; 255 without data and on ignored instances.
/// sediment: of bed and objects; 255 elsewhere and on ignored instances.
/// instance (16 bits): of objects and of the bed's features; 0 elsewhere; 65535 without data and
/// on ignored instances.
/// region: its number. `ignored` lists instance numbers.
/// Throws std::invalid_argument for a class or sediment above 254.
std::vector<Mask> encode_masks(const Waterfall& waterfall, std::span<const std::uint32_t> ignored);

}  // namespace ensonify::engine
