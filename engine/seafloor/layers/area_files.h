#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/layers/area.h>

namespace ensonify::engine {

/// A raster over a grid, with the pixels that are inside an area.
struct AreaImage {
  int columns = 0;
  int rows = 0;          ///< the northern row first
  double west_m = 0.0;   ///< local metres
  double north_m = 0.0;  ///< local metres
  double pixel_east_m = 1.0;
  double pixel_north_m = 1.0;
  std::vector<std::uint8_t> counts;  ///< 1 if the pixel is inside the area

  /// Whether the pixel at a place, or outside the image the nearest pixel, is inside the area.
  bool holds(const Eigen::Vector2d& place) const;
};

/// The raster stretched over the grid. Pixels with the value are inside the area.
AreaImage image_over(const Heightfield& grid, const AreaPixels& pixels, int value);

/// Reads an image of integers (PNG, indexed or grey; GeoTIFF). Pixels with the value are inside the
/// area. An image with coordinates lies at them in the grid's world, and must cover the grid. An
/// image without coordinates is stretched over the grid, and its proportions must differ from the
/// grid's by at most 2 per cent. Throws refine::MeshError for an image that cannot be read, does
/// not fit, is in another coordinate reference system than the grid, or does not have the value.
AreaImage read_area_image(const std::filesystem::path& file, const Heightfield& grid, int value);

struct PolygonWithHoles {
  Polygon border;
  std::vector<Polygon> holes;
};

/// Reads all polygons of a GeoJSON file, including polygons in collections, and converts them from
/// the grid's world to local metres. Throws refine::MeshError for a file that cannot be read, is in
/// another coordinate reference system than the grid, or holds no polygon.
std::vector<PolygonWithHoles> read_outlines(const std::filesystem::path& file,
                                            const Heightfield& grid);

}  // namespace ensonify::engine
