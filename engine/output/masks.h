#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <ensonify/engine/image/label_names.h>
#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/seafloor/seafloor.h>

namespace ensonify::engine {

inline constexpr std::uint16_t ignored_class = 255;  ///< also in sediment masks
inline constexpr std::uint16_t ignored_instance = max_labels;

/// A PNG picture of labels; the newest ping is on top.
struct Mask {
  std::string name;  ///< class, sediment, instance or region
  std::vector<std::byte> png;
};
/// All masks of a picture.
struct Masks {
  std::vector<Mask> files;
  std::vector<std::uint16_t> class_numbers;  ///< in the class mask, each once, ascending
};

/// What the masks of an image show.
struct MaskOptions {
  std::vector<std::uint32_t> ignored = {};  ///< numbers of instances
  std::uint16_t shadow_class = 0;           ///< for the shadows of instances; 0: no class
  LabelNames names = {};                    ///< written into the files
};

/// Four masks of a waterfall's picture. Their pixels have the numbers of the waterfall's layers:
/// class: the class on bed and objects; the shadow class in the shadows of instances; 255 without
/// data, on ignored instances and, if shadows are a class, in their shadows; 0 elsewhere.
/// sediment: the sediment on bed and objects; 255 elsewhere and on ignored instances.
/// instance (16 bits): the instance on objects and on features of the bed; 65535 without data and
/// on ignored instances; 0 elsewhere.
/// region: the number of the region.
/// The files of class, sediment and region have a text `names`, a JSON list: entry k is the name of
/// number k. Throws std::invalid_argument for a class or sediment above 254.
Masks encode_masks(const Waterfall& waterfall, const MaskOptions& options);

}  // namespace ensonify::engine
