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
  std::uint32_t instance = 0;  ///< of that target; 0: none
};

/// The target's body; if the picture does not show the body, the target's shadow.
inline const Outline& shown_part(const Target& target) {
  return target.body.area_px > 0 ? target.body : target.shadow;
}

/// Which of a sample's images: these numbers choose the random streams.
struct ImageNumber {
  std::uint64_t seed = 0;
  std::size_t sonar = 0, geometry = 0;
};

/// Whether an object is ignored for its size (DatasetOptions::least_px) in an image that shows as
/// much of it as this record. A feature of the bed never is.
bool is_too_small(const TargetRecord& record, const DatasetOptions& options);

/// The chips of a line: one per target, then backgrounds, then hard negatives, as the options ask.
/// A chip shows its target's whole body, unless the body is larger, and as much of the shadow as
/// there is room for.
/// There are none about targets that are too small for a label in the line, and so in all images.
/// `targets` are the line's, by instance; classes[n - 1] is the name of number n in its labels. A
/// chip without a target contains no pixel of an object or of its shadow; if classes are chosen,
/// only targets of these classes count. At most half of a background is water. Fewer
/// backgrounds and hard negatives are returned if there is no room for them, or if nothing
/// resembles a target. Throws as chip_size().
std::vector<Chip> choose_chips(const LabelledImage& line,
                               const std::map<std::uint32_t, TargetRecord>& targets,
                               const std::vector<std::string>& classes,
                               const DatasetOptions& options, const ImageNumber& image);

}  // namespace ensonify::engine
