#pragma once

#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/image/lettering.h>
#include <ensonify/engine/image/waterfall.h>

namespace ensonify::engine {

/// What a colour of a truth picture stands for.
struct LegendEntry {
  Rgb colour;
  std::string name;
};

/// A picture with the truth laid over it.
struct TruthPicture {
  Picture picture;                  ///< three channels
  std::vector<LegendEntry> legend;  ///< of what is in it
};

/// The truth as tints over a waterfall's own picture (display.h), pixel for pixel: regions without
/// an echo, shadows of things and of the bed; what has a class of its own in that class's colour;
/// and plain seabed by its sediment, where there are several. Instances have borders of the full
/// colour. Names as in Seafloor::classes and Seafloor::materials. Throws std::invalid_argument for
/// a picture of another size.
TruthPicture lay_truth(const Waterfall& waterfall, const Picture& picture,
                       std::span<const std::string> classes,
                       std::span<const std::string> materials);

/// A truth picture with its legend below.
Picture with_legend(const TruthPicture& truth);

}  // namespace ensonify::engine
