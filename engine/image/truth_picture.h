#pragma once

#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/image/lettering.h>
#include <ensonify/engine/image/waterfall.h>

namespace ensonify::engine {

/// The meaning of one colour of a truth picture.
struct LegendEntry {
  Rgb colour;
  std::string name;
};

/// A picture with the truth overlaid.
struct TruthPicture {
  Picture picture;                  ///< three channels
  std::vector<LegendEntry> legend;  ///< the colours that occur in it
};

/// The truth as tints over the picture of a waterfall (display.h), pixel by pixel: regions without
/// an echo; shadows of objects and of the bed; labelled objects and features in the colour of their
/// class; plain seabed by its sediment if there are several. Instances have borders in the full
/// colour. Names as in Seafloor::classes and Seafloor::materials. A picture that is
/// `in_ground_range` (Display::slant_range_correction) has no tint beyond the sonar's range. Throws
/// std::invalid_argument if the picture's size is not the waterfall's.
TruthPicture lay_truth(const Waterfall& waterfall, const Picture& picture,
                       std::span<const std::string> classes, std::span<const std::string> materials,
                       bool in_ground_range = false);

/// A truth picture with its legend below it.
Picture with_legend(const TruthPicture& truth);

}  // namespace ensonify::engine
