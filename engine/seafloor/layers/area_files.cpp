#include <ensonify/engine/seafloor/layers/area_files.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>

#include <Eigen/Geometry>
#include <cpl_conv.h>
#include <cpl_error.h>
#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogrsf_frmts.h>

#include <ensonify/engine/seafloor/bed/files_beside.h>
#include <ensonify/engine/seafloor/bed/geographic.h>
#include <ensonify/engine/seafloor/bed/reference_map.h>
#include <ensonify/engine/seafloor/bed/refuse_file.h>
#include <ensonify/engine/seafloor/bed/survey_formats.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {
namespace {

constexpr double max_pixels = 268435456.0;  // 2^28
constexpr std::size_t max_points = 100000;  // in all outlines together
constexpr std::uintmax_t most_outline_bytes = 1 << 26;

/// Settings of GDAL in this thread while a file is read: GDAL prints no messages, and of the files
/// beside this file it reads only those that were checked.
class Quiet {
 public:
  explicit Quiet(const std::filesystem::path& file)
      : beside_(file), metadata_("GDAL_PAM_ENABLED", beside_.reads_metadata(), false) {}

 private:
  FilesBeside beside_;
  CPLErrorHandlerPusher handler_{CPLQuietErrorHandler};
  CPLConfigOptionSetter metadata_;
};

std::unique_ptr<GDALDataset> open(const std::filesystem::path& file, unsigned kind,
                                  const char* const* drivers, const char* what) {
  [[maybe_unused]] static const bool registered = (GDALAllRegister(), true);
  std::unique_ptr<GDALDataset> dataset(GDALDataset::Open(
      std::filesystem::absolute(file).c_str(), kind | GDAL_OF_READONLY, drivers, nullptr, nullptr));
  if (!dataset) refuse_file(file, fmt::format("cannot be read as {}", what));
  return dataset;
}

/// Refuses a map in metres whose reference system puts the same coordinates at another place on
/// Earth than the grid's system. Accepts degrees, because GDAL reports degrees if a GeoJSON file
/// states no reference system.
void require_reference(const std::filesystem::path& file, const OGRSpatialReference* its,
                       const Heightfield& grid, const char* tool) {
  if (!its || its->IsGeographic() || grid.reference.empty()) return;
  const PlaceOfMap here = place_of_reference(wkt_of(*its)),
                   there = place_of_reference(grid.reference);
  if (!here || !there) return;
  constexpr double same_m = 5.0;  // datums that count as WGS 84 differ by less
  try {
    const Eigen::Vector2d middle = grid.world_origin.head<2>();
    if (tangent_place(here(middle).where, there(middle).where).place.norm() < same_m) return;
  } catch (const std::invalid_argument&) {  // outside the range of one of the maps
  }
  refuse_file(file,
              fmt::format("has another coordinate reference system ('{}') than the survey; put it "
                          "into the survey's with {} -t_srs",
                          its->GetName() ? its->GetName() : "", tool));
}

void stretch_over(const Heightfield& grid, AreaImage& image) {
  image.west_m = grid.x_m(0);
  image.north_m = grid.y_m(grid.rows - 1);
  image.pixel_east_m = (grid.x_m(grid.columns - 1) - image.west_m) / image.columns;
  image.pixel_north_m = (image.north_m - grid.y_m(0)) / image.rows;
}

void place(AreaImage& image, GDALDataset& dataset, const std::filesystem::path& file,
           const Heightfield& grid) {
  const double east = grid.x_m(grid.columns - 1) - grid.x_m(0);
  const double north = grid.y_m(grid.rows - 1) - grid.y_m(0);
  std::array<double, 6> transform{};
  if (dataset.GetGeoTransform(transform.data()) == CE_None) {
    if (!(transform[1] > 0.0 && transform[5] < 0.0 && transform[2] == 0.0 && transform[4] == 0.0))
      refuse_file(file, "does not lie with north up; gdalwarp turns it");
    if (!std::ranges::all_of(transform, [](double x) { return std::isfinite(x); }))
      refuse_file(file,
                  "has no finite place and pixel size; give it the right corners with "
                  "gdal_translate -a_ullr");
    image.west_m = transform[0] - grid.world_origin.x();
    image.north_m = transform[3] - grid.world_origin.y();
    image.pixel_east_m = transform[1];
    image.pixel_north_m = -transform[5];
    const double east_edge = image.west_m + image.columns * image.pixel_east_m;
    const double south_edge = image.north_m - image.rows * image.pixel_north_m;
    if (!(image.west_m <= grid.x_m(0) && image.north_m >= grid.y_m(grid.rows - 1) &&
          east_edge >= grid.x_m(grid.columns - 1) && south_edge <= grid.y_m(0)))
      refuse_file(
          file,
          fmt::format("does not cover the seabed: it spans {:.1f} to {:.1f} m east and {:.1f} to "
                      "{:.1f} m north of the seabed's middle, which reaches {:.1f} and {:.1f} m",
                      image.west_m, east_edge, south_edge, image.north_m, 0.5 * east, 0.5 * north));
    return;
  }
  const double proportions = (image.columns / east) / (image.rows / north);
  if (!(std::abs(proportions - 1.0) <= 0.02))
    refuse_file(
        file, fmt::format("has {} x {} pixels and no coordinates, and so would be stretched over a "
                          "seabed of {:.1f} x {:.1f} m; give it the seabed's proportions",
                          image.columns, image.rows, east, north));
  stretch_over(grid, image);
}

}  // namespace

bool AreaImage::holds(const Eigen::Vector2d& place_m) const {
  // A ragged border may need places outside the image: they have the value of the nearest pixel.
  const double column = std::floor((place_m.x() - west_m) / pixel_east_m - 1e-9);
  const double row = std::floor((north_m - place_m.y()) / pixel_north_m - 1e-9);
  const auto c = static_cast<std::size_t>(std::clamp(column, 0.0, columns - 1.0));
  const auto r = static_cast<std::size_t>(std::clamp(row, 0.0, rows - 1.0));
  return counts[r * static_cast<std::size_t>(columns) + c] != 0;
}

AreaImage image_over(const Heightfield& grid, const AreaPixels& pixels, int value) {
  AreaImage image;
  image.columns = pixels.columns;
  image.rows = pixels.rows;
  stretch_over(grid, image);
  for (const std::uint8_t pixel : pixels.values) image.counts.push_back(pixel == value);
  return image;
}

AreaImage read_area_image(const std::filesystem::path& file, const Heightfield& grid, int value) {
  const Quiet quiet(file);
  constexpr std::array<const char*, 3> drivers = {"PNG", "GTiff", nullptr};
  const auto dataset = open(file, GDAL_OF_RASTER, drivers.data(), "PNG or GeoTIFF; is it whole?");
  AreaImage image;
  image.columns = dataset->GetRasterXSize();
  image.rows = dataset->GetRasterYSize();
  const double pixels = static_cast<double>(image.columns) * image.rows;
  const auto bytes = static_cast<double>(std::filesystem::file_size(file));
  if (pixels > max_pixels || pixels > 2000.0 * bytes)
    refuse_file(file,
                fmt::format("promises {} x {} pixels; expected at most 2^28, and a file that holds "
                            "them",
                            image.columns, image.rows));
  if (dataset->GetRasterCount() != 1)
    refuse_file(file,
                fmt::format("has {} channels; expected one, whose values are the patches' numbers "
                            "(indexed colours or grey)",
                            dataset->GetRasterCount()));
  GDALRasterBand& band = *dataset->GetRasterBand(1);
  require_reference(file, dataset->GetSpatialRef(), grid, "gdalwarp");
  place(image, *dataset, file, grid);
  image.counts.resize(static_cast<std::size_t>(pixels));
  std::vector<double> row(static_cast<std::size_t>(image.columns));
  bool found = false;
  for (int r = 0; r < image.rows; ++r) {
    if (band.RasterIO(GF_Read, 0, r, image.columns, 1, row.data(), image.columns, 1, GDT_Float64, 0,
                      0, nullptr) != CE_None)
      refuse_file(file, fmt::format("row {} of {} cannot be read; the file is truncated or damaged",
                                    r + 1, image.rows));
    for (std::size_t c = 0; c < row.size(); ++c) {
      const bool counts = row[c] == value;
      found = found || counts;
      image.counts[static_cast<std::size_t>(r) * row.size() + c] = counts;
    }
  }
  if (!found) refuse_file(file, fmt::format("has no pixel of the value {}", value));
  return image;
}

std::vector<PolygonWithHoles> read_outlines(const std::filesystem::path& file,
                                            const Heightfield& grid) {
  const Quiet quiet(file);
  if (const std::uintmax_t bytes = std::filesystem::file_size(file); bytes > most_outline_bytes)
    refuse_file(file, fmt::format("has {} bytes, expected at most {}", bytes, most_outline_bytes));
  constexpr std::array<const char*, 2> drivers = {"GeoJSON", nullptr};
  const auto dataset = open(file, GDAL_OF_VECTOR, drivers.data(), "GeoJSON");
  std::vector<PolygonWithHoles> outlines;
  std::size_t points = 0;
  const auto polygon_of = [&](const OGRLinearRing& ring) {
    points += static_cast<std::size_t>(ring.getNumPoints());
    if (points > max_points) refuse_file(file, fmt::format("has more than {} points", max_points));
    Polygon polygon;
    for (int i = 0; i < ring.getNumPoints(); ++i)
      polygon.emplace_back(ring.getX(i) - grid.world_origin.x(),
                           ring.getY(i) - grid.world_origin.y());
    if (!std::ranges::all_of(polygon,
                             [](const Eigen::Vector2d& point) { return point.allFinite(); }))
      refuse_file(file, "has a point whose coordinates are not finite numbers");
    // The last point should repeat the first, but some programs omit it.
    if (polygon.size() > 1 && polygon.front() == polygon.back()) polygon.pop_back();
    if (polygon.size() < 3) refuse_file(file, "has a polygon of less than three points");
    return polygon;
  };
  const auto add_polygon = [&](const OGRPolygon& polygon) {
    if (polygon.IsEmpty()) return;
    PolygonWithHoles& outline = outlines.emplace_back();
    outline.border = polygon_of(*polygon.getExteriorRing());
    for (int i = 0; i < polygon.getNumInteriorRings(); ++i)
      outline.holes.push_back(polygon_of(*polygon.getInteriorRing(i)));
  };
  const auto add_polygons = [&](const auto& add_its, const OGRGeometry& geometry) -> void {
    const OGRwkbGeometryType type = wkbFlatten(geometry.getGeometryType());
    if (type == wkbPolygon)
      add_polygon(*geometry.toPolygon());
    else if (type == wkbMultiPolygon || type == wkbGeometryCollection)
      for (const OGRGeometry* part : *geometry.toGeometryCollection()) add_its(add_its, *part);
  };
  for (int i = 0; i < dataset->GetLayerCount(); ++i) {
    require_reference(file, dataset->GetLayer(i)->GetSpatialRef(), grid, "ogr2ogr");
    for (const auto& feature : dataset->GetLayer(i))
      if (const OGRGeometry* geometry = feature->GetGeometryRef())
        add_polygons(add_polygons, *geometry);
  }
  if (outlines.empty()) refuse_file(file, "holds no polygon");
  Eigen::AlignedBox2d all;
  for (const PolygonWithHoles& outline : outlines)
    for (const Eigen::Vector2d& point : outline.border) all.extend(point);
  if (all.sizes().maxCoeff() < std::min(grid.cell_east_m, grid.cell_north_m))
    refuse_file(
        file,
        "is smaller than a cell of the seabed, so it seems to be in degrees; put it into the "
        "seabed's metres");
  return outlines;
}

}  // namespace ensonify::engine
