#include <ensonify/engine/mosaic/mosaic_file.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <cpl_conv.h>
#include <cpl_error.h>
#include <cpl_string.h>
#include <fmt/format.h>
#include <gdal_frmts.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <ensonify/engine/seafloor/bed/survey_formats.h>

namespace ensonify::engine {
namespace {

constexpr int smallest_overview_px = 256;

/// The pixels of a type in GDAL.
struct GdalPixels {
  GDALDataType type;
  double no_data;
};
GdalPixels gdal_pixels(PixelType type) {
  if (type == PixelType::brightness) return {GDT_Byte, 0.0};
  if (type == PixelType::label) return {GDT_UInt16, 65535.0};
  return {GDT_Float32, std::numeric_limits<double>::quiet_NaN()};
}

/// Calls work(), which calls GDAL. Keeps GDAL from printing. Throws std::runtime_error with the
/// first error that GDAL reports, also in destructors.
template <class Work>
void with_gdal(const std::filesystem::path& file, Work&& work) {
  std::string error;
  {
    const CPLErrorHandlerPusher watch(
        [](CPLErr kind, CPLErrorNum, const char* message) {
          auto& first = *static_cast<std::string*>(CPLGetErrorHandlerUserData());
          if (kind >= CE_Failure && first.empty()) first = message;
        },
        &error);
    const CPLConfigOptionSetter no_sidecars("GDAL_PAM_ENABLED", "NO", false);
    work();
  }
  if (!error.empty())
    throw std::runtime_error(
        fmt::format("{}: cannot write it ({}); is there enough space, and may you write there?",
                    file.string(), error));
}

}  // namespace

MosaicFile::MosaicFile(const std::filesystem::path& file, std::int64_t columns, std::int64_t rows,
                       const Eigen::Vector2d& corner_m, double pixel_m, PixelType type,
                       const std::string& description, const std::string& reference,
                       const std::map<std::string, std::string>& texts)
    : file_(file), type_(type), new_file_(file) {
  [[maybe_unused]] static const bool registered = (GDALRegister_GTiff(), true);
  GDALSetCacheMax64(gdal_cache_bytes);
  CPLStringList options;
  options.SetNameValue("TILED", "YES");
  options.SetNameValue("COMPRESS", "DEFLATE");
  options.SetNameValue("PREDICTOR", type == PixelType::value ? "3" : "2");
  options.SetNameValue("BIGTIFF", "IF_SAFER");
  with_gdal(file, [&] {
    dataset_.reset(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
        new_file_.temporary().c_str(), static_cast<int>(columns), static_cast<int>(rows), 1,
        gdal_pixels(type).type, options.List()));
    if (!dataset_) return;
    std::array<double, 6> transform{corner_m.x(), pixel_m, 0.0, corner_m.y(), 0.0, -pixel_m};
    dataset_->SetGeoTransform(transform.data());
    if (!reference.empty()) {
      OGRSpatialReference system;
      if (system.importFromWkt(reference.c_str()) != OGRERR_NONE)
        CPLError(CE_Failure, CPLE_AppDefined, "PROJ cannot read the coordinate reference system");
      system.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
      dataset_->SetSpatialRef(&system);
    }
    dataset_->GetRasterBand(1)->SetNoDataValue(gdal_pixels(type).no_data);
    dataset_->GetRasterBand(1)->SetDescription(description.c_str());
    for (const auto& [name, text] : texts) dataset_->SetMetadataItem(name.c_str(), text.c_str());
  });
}

// NewFile removes an unfinished file, so errors of GDAL do not matter here.
MosaicFile::~MosaicFile() {
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  dataset_.reset();
}

void MosaicFile::write(std::int64_t left, std::int64_t top, std::int64_t columns, std::int64_t rows,
                       std::vector<float> pixels) {
  const auto none = static_cast<float>(gdal_pixels(type_).no_data);
  for (float& pixel : pixels)
    if (std::isnan(pixel)) pixel = none;
  with_gdal(file_, [&] {
    [[maybe_unused]] const CPLErr watched = dataset_->GetRasterBand(1)->RasterIO(
        GF_Write, static_cast<int>(left), static_cast<int>(top), static_cast<int>(columns),
        static_cast<int>(rows), pixels.data(), static_cast<int>(columns), static_cast<int>(rows),
        GDT_Float32, 0, 0, nullptr);
  });
}

bool MosaicFile::finish(const std::function<bool(double share)>& progress) {
  std::vector<int> levels;
  const int longest_px = std::max(dataset_->GetRasterXSize(), dataset_->GetRasterYSize());
  for (int level = 2; longest_px / (level / 2) > smallest_overview_px; level *= 2)
    levels.push_back(level);
  bool stopped = false;
  const std::function<bool(double)> watch = [&](double share) {
    stopped = stopped || !progress(share);
    return !stopped;
  };
  try {
    with_gdal(file_, [&] {
      dataset_->FlushCache(false);
      if (!levels.empty())
        dataset_->BuildOverviews(
            type_ == PixelType::label ? "NEAREST" : "AVERAGE", static_cast<int>(levels.size()),
            levels.data(), 0, nullptr,
            [](double share, const char*, void* data) {
              return (*static_cast<const std::function<bool(double)>*>(data))(share) ? TRUE : FALSE;
            },
            const_cast<std::function<bool(double)>*>(&watch));
      dataset_.reset();
    });
  } catch (const std::runtime_error&) {
    if (!stopped) throw;  // GDAL reports a stop as an error
  }
  if (stopped) return false;
  new_file_.commit();
  return true;
}

}  // namespace ensonify::engine
