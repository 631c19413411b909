#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/base/input_file.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/layers/layer_draws.h>

namespace ensonify::engine {

/// Points of a closed polygon, local metres (east, north). The last may repeat the first.
using Polygon = std::vector<Eigen::Vector2d>;

/// The pixels of a raster that is stretched over the seabed. The northern row is first.
struct AreaPixels {
  int columns = 0, rows = 0;
  std::vector<std::uint8_t> values;
};

/// A part of the seabed: where all limits that are given hold; the whole seabed without limits.
struct Area {
  Polygon polygon_m;
  InputFile outline;      ///< GeoJSON polygons in the seabed's world coordinates
  double radius_m = 0.0;  ///< radius of a disc; 0: no disc
  double middle_east_m = 0.0;
  double middle_north_m = 0.0;
  InputFile image;  ///< a raster; without coordinates it is stretched over the seabed
  std::shared_ptr<const AreaPixels> pixels;          ///< used instead of `image` if not null
  int image_value = 1;                               ///< value of the pixels inside the area
  std::optional<double> shallowest_m, deepest_m;     ///< depth of the bed before its layers
  std::optional<double> gentlest_rad, steepest_rad;  ///< slope of the bed, over border_m
  std::string on;         ///< material that the map must have there; empty: any
  double share = 1.0;     ///< share of the places within all other limits, in ragged patches
  double patch_m = 30.0;  ///< typical size of these patches
  double border_m = 1.0;  ///< relief fades in, and two sediments mix, over this width
  double ragged_m = 0.0;  ///< rms distance of the border from the border of the limits above
  int number = 0;         ///< selects the random numbers; 0: the layer's place in its list

  /// The number that selects the random numbers of the layer at this place of its list, from 0.
  std::size_t number_at(std::size_t place) const {
    return number > 0 ? static_cast<std::size_t>(number) : place + 1;
  }
};

/// The ground on which an area is found: heights before any layer, and the materials of the map.
struct AreaGround {
  const Heightfield& base;
  std::function<bool(std::size_t point, const std::string& material)> has_material;
};

/// 1 for each point of the grid in the area, otherwise 0. A window of a grid gets the values that
/// the whole grid has there. The exception is a `share` below 1, which in a window follows from the
/// statistics of the patches and is right only on average. Throws std::invalid_argument for an area
/// without a point of a whole grid, and refine::MeshError for files that are unreadable or unfit.
std::vector<double> area_mask(const Area& area, const AreaGround& ground, const LayerDraws& draws);

/// The message that no point of a grid can be in the polygons and the disc of an area; empty if a
/// point may be in them. The grid needs no heights. For an area with a ragged border only the
/// bounding box is tested. Throws what area_mask() throws.
std::string fault_of_place(const Area& area, const Heightfield& grid);

/// A mask whose borders rise from 0 to 1 over a width: means of the mask over about this width.
/// Holes of the grid are 0, and the means leave them out.
std::vector<double> softened(std::vector<double> mask, const Heightfield& grid, double width_m);

/// The first two sides of a polygon that cross or touch, by the indices of their first points;
/// nullopt if there are none.
std::optional<std::pair<std::size_t, std::size_t>> crossing_sides(const Polygon& polygon);

}  // namespace ensonify::engine
