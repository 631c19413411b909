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

/// A rectangle of a line to be cut out as a picture.
struct Chip {
  Rectangle part;
  std::string kind;  ///< chip, background or hard_negative
  std::string of;    ///< class of its target or lookalike, or "shadow"; empty for a background
  std::uint32_t instance = 0;  ///< instance of its target or lookalike; 0: none
};

/// The target's body; if the picture does not show the body, the target's shadow.
inline const Outline& shown_part(const Target& target) {
  return target.body.area_px > 0 ? target.body : target.shadow;
}

/// Identifies one of a sample's images. These numbers choose the random streams.
struct ImageNumber {
  std::uint64_t seed = 0;
  std::size_t sonar = 0, geometry = 0;
};

/// Whether an object whose body in an image is that of this record is too small for a label
/// (DatasetOptions::least_px). False for a feature of the bed.
bool is_too_small(const TargetRecord& record, const DatasetOptions& options);

/// The chips of a line as the options ask: one per target, then backgrounds, then hard negatives.
///
/// A chip of a target shows the target's whole body, unless the body is larger than the chip, and
/// as much of the shadow as there is room for. A target that is too small for a label in the line
/// has no chip. A background contains no pixel of a target or of its shadow, and is at most half
/// water. A hard negative shows something that resembles a target, and no pixel of a target of the
/// chosen classes. Fewer backgrounds and hard negatives are returned if there is no room for them
/// or nothing resembles a target.
///
/// `targets` are the targets of the line, by instance; classes[n - 1] is the name of number n in
/// its labels. Throws as chip_size().
std::vector<Chip> choose_chips(const LabelledImage& line,
                               const std::map<std::uint32_t, TargetRecord>& targets,
                               const std::vector<std::string>& classes,
                               const DatasetOptions& options, const ImageNumber& image);

}  // namespace ensonify::engine
