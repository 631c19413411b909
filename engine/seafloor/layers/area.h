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

/// Points of a closed polygon, local metres (east, north). The first may be repeated at the end.
using Polygon = std::vector<Eigen::Vector2d>;

/// The pixels of a raster that is stretched over the seabed, the northern row first.
struct AreaPixels {
  int columns = 0, rows = 0;
  std::vector<std::uint8_t> values;
};

/// A part of the seabed. All limits that are given hold at once; with none it is everywhere.
struct Area {
  Polygon polygon_m;
  InputFile outline;      ///< GeoJSON polygons in the seabed's world coordinates
  double radius_m = 0.0;  ///< a disc; 0: none
  double middle_east_m = 0.0;
  double middle_north_m = 0.0;
  InputFile image;  ///< a raster: the seabed from above if it has no coordinates
  std::shared_ptr<const AreaPixels> pixels;          ///< its content, if it need not be read
  int image_value = 1;                               ///< the pixels that count
  std::optional<double> shallowest_m, deepest_m;     ///< depth of the bed before its layers
  std::optional<double> gentlest_rad, steepest_rad;  ///< its slope, averaged over the border
  std::string on;         ///< where the map has this material; empty: anywhere
  double share = 1.0;     ///< the share that the area covers of all this, in ragged patches
  double patch_m = 30.0;  ///< typical size of these patches
  double border_m = 1.0;  ///< relief fades in over this width, and two sediments mix
  double ragged_m = 0.0;  ///< rms distance of the border from that of the limits above
  int number = 0;         ///< selects its random numbers; 0: the layer's place in its list

  /// The number, where the area's layer is at this place of its list, from 0.
  std::size_t number_at(std::size_t place) const {
    return number > 0 ? static_cast<std::size_t>(number) : place + 1;
  }
};

/// What an area is laid on: heights before any layer, and the material of the map at each point.
struct AreaGround {
  const Heightfield& base;
  std::function<bool(std::size_t point, const std::string& material)> has_material;
};

/// Where an area lies, 1 or 0 for each point of the grid. In a window of a larger grid it lies
/// where it does in the whole grid. Only a `share` below 1 is right on average alone, since it then
/// follows from the patches' statistics. Throws std::invalid_argument for an area that misses a
/// whole grid, and refine::MeshError for files that cannot be read or do not fit.
std::vector<double> area_mask(const Area& area, const AreaGround& ground, const LayerDraws& draws);

/// Why no point of a grid can be in an area, by its polygons and its disc; empty if one may be. It
/// needs no heights. Of an area with a ragged border only the bounding box counts. Throws as
/// area_mask().
std::string fault_of_place(const Area& area, const Heightfield& grid);

/// A mask with borders that rise from 0 to 1 over a width: its mean over about that width. Holes of
/// the grid are 0, but do not count in the means.
std::vector<double> softened(std::vector<double> mask, const Heightfield& grid, double width_m);

/// The first two sides of a polygon that cross or touch, by the indices of their first points; none
/// if no sides do.
std::optional<std::pair<std::size_t, std::size_t>> crossing_sides(const Polygon& polygon);

}  // namespace ensonify::engine
