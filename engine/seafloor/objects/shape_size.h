#pragma once

#include <optional>

namespace ensonify::engine {

/// Sizes of a shape in metres. If a size is unset, the shape's usual size is used.
struct ShapeSize {
  std::optional<double> length_m;        ///< along y, where the heading points
  std::optional<double> width_m;         ///< along x, across the heading
  std::optional<double> shape_height_m;  ///< from the lowest point to the highest
  std::optional<double> diameter_m;      ///< of a round shape
  std::optional<double> top_diameter_m;  ///< of a cone's upper end
  std::optional<double> rod_m;           ///< thickness of rods, wires and twine
  std::optional<double> facet_m;         ///< edge length of the facets of round parts
  /// Largest angle between neighbouring facets of round parts, used if facet_m is unset. It is not
  /// a scene key, because it follows from the lobe of the material.
  std::optional<double> facet_rad;
};

}  // namespace ensonify::engine
