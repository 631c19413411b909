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

/// Tints each pixel of the picture of a waterfall (display.h) by its truth. There are colours for
/// regions without an echo, shadows of objects, shadows of the bed, each class of labelled objects
/// and features, and each sediment of plain seabed if there are several sediments. Borders of
/// instances have the full colour. `classes` and `materials` are as in Seafloor. Columns of the
/// picture that show nothing have no tint. Throws std::invalid_argument if the picture does not
/// have the rows of the waterfall and these columns.
TruthPicture lay_truth(const Waterfall& waterfall, const Picture& picture,
                       std::span<const std::string> classes, std::span<const std::string> materials,
                       PictureColumns columns);

/// A truth picture with its legend below it.
Picture with_legend(const TruthPicture& truth);

}  // namespace ensonify::engine
