#include <ensonify/engine/output/geotiff.h>

#include <array>
#include <limits>
#include <memory>
#include <span>
#include <stdexcept>

#include <cpl_conv.h>
#include <cpl_error.h>
#include <cpl_vsi.h>
#include <fmt/format.h>
#include <gdal_frmts.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

namespace ensonify::engine {

std::vector<std::byte> encode_geotiff(const Heightfield& field, const std::string& reference) {
  [[maybe_unused]] static const bool registered = (GDALRegister_GTiff(), true);
  // GDAL's memory files share one folder; the field's address makes this name unique.
  const std::string name = fmt::format("/vsimem/ensonify-{}.tif", fmt::ptr(&field));
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  const CPLConfigOptionSetter no_sidecars("GDAL_PAM_ENABLED", "NO", false);
  std::unique_ptr<GDALDataset> grid(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      name.c_str(), field.columns, field.rows, 1, GDT_Float32, nullptr));
  const auto check = [&](bool done, bool reference_is_lost = false) {
    if (done) return;
    const std::string reason = CPLGetLastErrorMsg();
    grid.reset();
    VSIUnlink(name.c_str());
    throw std::runtime_error(
        reference_is_lost || reason.starts_with("PROJ")
            ? fmt::format("cannot write the coordinate reference system into a GeoTIFF ({}); does "
                          "PROJ find its database (PROJ_DATA), and is there enough memory?",
                          reason.empty() ? "no reason given" : reason)
            : fmt::format("cannot make a GeoTIFF of {} x {} cells ({}); is there enough memory?",
                          field.columns, field.rows, reason));
  };
  check(grid != nullptr);
  const Eigen::Vector3d& origin = field.world_origin;
  std::array<double, 6> transform = {
      origin.x() + field.x_m(0) - 0.5 * field.cell_east_m,
      field.cell_east_m,
      0.0,
      origin.y() + field.y_m(field.rows - 1) + 0.5 * field.cell_north_m,
      0.0,
      -field.cell_north_m};
  GDALRasterBand& band = *grid->GetRasterBand(1);
  check(grid->SetGeoTransform(transform.data()) == CE_None);
  if (!reference.empty()) {
    OGRSpatialReference system;
    check(system.importFromWkt(reference.c_str()) == OGRERR_NONE, true);
    system.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    check(grid->SetSpatialRef(&system) == CE_None, true);
  }
  check(band.SetNoDataValue(std::numeric_limits<double>::quiet_NaN()) == CE_None);
  std::vector<double> heights(static_cast<std::size_t>(field.columns));
  for (int line = 0; line < field.rows; ++line) {
    for (int column = 0; column < field.columns; ++column)
      heights[static_cast<std::size_t>(column)] =
          origin.z() + field.at(column, field.rows - 1 - line);
    check(band.RasterIO(GF_Write, 0, line, field.columns, 1, heights.data(), field.columns, 1,
                        GDT_Float64, 0, 0, nullptr) == CE_None);
  }
  CPLErrorReset();
  grid->FlushCache(true);
  check(CPLGetLastErrorType() < CE_Failure);
  if (!reference.empty()) {
    // GDAL reports nothing where it leaves the reference system out.
    grid.reset(GDALDataset::Open(name.c_str()));
    check(grid && grid->GetSpatialRef(), true);
  }
  grid.reset();
  vsi_l_offset size = 0;
  const std::unique_ptr<GByte, void (*)(void*)> bytes(
      VSIGetMemFileBuffer(name.c_str(), &size, /* take ownership: */ TRUE), VSIFree);
  check(bytes != nullptr);
  const auto all = std::as_bytes(std::span(bytes.get(), static_cast<std::size_t>(size)));
  return {all.begin(), all.end()};
}

}  // namespace ensonify::engine
