#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/layers/area.h>

namespace ensonify::engine {

/// Which pixels of a raster count, laid over a grid.
struct AreaImage {
  int columns = 0;
  int rows = 0;          ///< the northern row first
  double west_m = 0.0;   ///< local metres
  double north_m = 0.0;  ///< local metres
  double pixel_east_m = 1.0;
  double pixel_north_m = 1.0;
  std::vector<std::uint8_t> counts;  ///< 1 where a pixel has the value

  /// Whether the pixel at a place counts, or outside the image the nearest one.
  bool holds(const Eigen::Vector2d& place) const;
};

/// Which of these pixels have the value, stretched over the grid.
AreaImage image_over(const Heightfield& grid, const AreaPixels& pixels, int value);

/// Reads an image of integers (PNG, indexed or grey; GeoTIFF). An image with coordinates lies at
/// these in the grid's world, and must cover the grid; one without is stretched over the grid, and
/// must have its proportions within 2 per cent. Throws refine::MeshError for an image that cannot
/// be read, does not fit, is in another coordinate reference system than the grid, or does not have
/// the value.
AreaImage read_area_image(const std::filesystem::path& file, const Heightfield& grid, int value);

/// A polygon with holes.
struct PolygonWithHoles {
  Polygon border;
  std::vector<Polygon> holes;
};

/// Reads all polygons of a GeoJSON file, also those in collections, and moves them from the grid's
/// world to local metres. Throws refine::MeshError for a file that cannot be read, is in another
/// coordinate reference system than the grid, or holds no polygon.
std::vector<PolygonWithHoles> read_outlines(const std::filesystem::path& file,
                                            const Heightfield& grid);

}  // namespace ensonify::engine
