#pragma once

#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/image/lettering.h>
#include <ensonify/engine/image/picture_columns.h>
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
/// colour. Names as in Seafloor::classes and Seafloor::materials. Columns of the picture that show
/// nothing have no tint. Throws std::invalid_argument if the picture's size is not that of the
/// waterfall in these columns.
TruthPicture lay_truth(const Waterfall& waterfall, const Picture& picture,
                       std::span<const std::string> classes, std::span<const std::string> materials,
                       PictureColumns columns);

/// A truth picture with its legend below it.
Picture with_legend(const TruthPicture& truth);

}  // namespace ensonify::engine
