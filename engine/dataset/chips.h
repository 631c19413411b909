#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <ensonify/engine/dataset/labelled_image.h>
#include <ensonify/engine/image/target_record.h>
#include <ensonify/engine/scene/keys/dataset_options.h>

namespace ensonify::engine {

/// A part of a line to be cut out.
struct Chip {
  Rectangle part;
  std::string kind;  ///< chip, background or hard_negative
  std::string of;    ///< class of its target or lookalike, or "shadow"; empty for a background
};

/// Which of a sample's images: these numbers choose the random streams.
struct ImageNumber {
  std::uint64_t seed = 0;
  std::size_t sonar = 0, geometry = 0;
};

/// The chips of a line: one per target, then backgrounds, then hard negatives, as the options ask.
/// `targets` are the line's, by instance; classes[n - 1] is the name of number n in its labels. A
/// chip without a target contains no pixel of an object or of its shadow; if classes are chosen,
/// only targets of these classes count. At most half of a background is water. Fewer
/// backgrounds and hard negatives are returned if there is no room for them, or if nothing
/// resembles a target. Throws std::invalid_argument if the line is smaller than chips of a fixed
/// size.
std::vector<Chip> choose_chips(const LabelledImage& line,
                               const std::map<std::uint32_t, TargetRecord>& targets,
                               const std::vector<std::string>& classes, const ChipOptions& options,
                               const ImageNumber& image);

}  // namespace ensonify::engine
