#pragma once

#include <optional>

namespace ensonify::engine {

/// Sizes of a shape in metres; what is unset is the shape's own usual size.
struct ShapeSize {
  std::optional<double> length_m;        ///< along y, where the heading points
  std::optional<double> width_m;         ///< across it
  std::optional<double> shape_height_m;  ///< from its lowest place to its highest
  std::optional<double> diameter_m;      ///< of what is round
  std::optional<double> top_diameter_m;  ///< of a cone's upper end
  std::optional<double> rod_m;           ///< thickness of rods, wires and twine
  std::optional<double> facet_m;         ///< edge of its facets where it is round
  /// Widest angle between neighbouring facets of what is round, where facet_m does not say; no key:
  /// the lobe of the material asks for it.
  std::optional<double> facet_rad;
};

}  // namespace ensonify::engine
