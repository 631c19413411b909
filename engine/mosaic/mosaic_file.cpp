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

#include <ensonify/engine/seafloor/bed/gdal_cache.h>

namespace ensonify::engine {
namespace {

constexpr int smallest_overview_px = 256;

double no_data(PixelType type) {
  switch (type) {
    case PixelType::brightness: return 0.0;
    case PixelType::label: return 65535.0;
    case PixelType::value: break;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

GDALDataType gdal_type(PixelType type) {
  switch (type) {
    case PixelType::brightness: return GDT_Byte;
    case PixelType::label: return GDT_UInt16;
    case PixelType::value: break;
  }
  return GDT_Float32;
}

/// Keeps the first error of GDAL, also of its destructors, and keeps GDAL from printing.
class FirstError {
 public:
  explicit FirstError(std::string& into) {
    CPLPushErrorHandlerEx(
        [](CPLErr kind, CPLErrorNum, const char* message) {
          auto& first = *static_cast<std::string*>(CPLGetErrorHandlerUserData());
          if (kind >= CE_Failure && first.empty()) first = message;
        },
        &into);
  }
  ~FirstError() { CPLPopErrorHandler(); }
  FirstError(const FirstError&) = delete;
  FirstError& operator=(const FirstError&) = delete;
};

}  // namespace

struct MosaicFile::Open {
  /// Calls work(), which calls GDAL. Throws std::runtime_error if GDAL reports an error.
  template <class Work>
  void with_gdal(const std::filesystem::path& file, Work&& work) {
    std::string error;
    {
      const FirstError watch(error);
      const CPLConfigOptionSetter no_sidecars("GDAL_PAM_ENABLED", "NO", false);
      work();
    }
    if (!error.empty())
      throw std::runtime_error(
          fmt::format("{}: cannot write it ({}); is there enough space, and may you write there?",
                      file.string(), error));
  }

  std::unique_ptr<GDALDataset> dataset;
};

MosaicFile::MosaicFile(const std::filesystem::path& file, std::int64_t columns, std::int64_t rows,
                       const Eigen::Vector2d& corner_m, double pixel_m, PixelType type,
                       const std::string& description, const std::string& reference,
                       const std::map<std::string, std::string>& texts)
    : file_(file), type_(type), new_file_(file), open_(std::make_unique<Open>()) {
  [[maybe_unused]] static const bool registered = (GDALRegister_GTiff(), true);
  GDALSetCacheMax64(gdal_cache_bytes);
  CPLStringList options;
  options.SetNameValue("TILED", "YES");
  options.SetNameValue("COMPRESS", "DEFLATE");
  options.SetNameValue("PREDICTOR", type == PixelType::value ? "3" : "2");
  options.SetNameValue("BIGTIFF", "IF_SAFER");
  open_->with_gdal(file, [&] {
    std::unique_ptr<GDALDataset>& dataset = open_->dataset;
    dataset.reset(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
        new_file_.temporary().c_str(), static_cast<int>(columns), static_cast<int>(rows), 1,
        gdal_type(type), options.List()));
    if (!dataset) return;
    std::array<double, 6> transform{corner_m.x(), pixel_m, 0.0, corner_m.y(), 0.0, -pixel_m};
    dataset->SetGeoTransform(transform.data());
    if (!reference.empty()) {
      OGRSpatialReference system;
      if (system.importFromWkt(reference.c_str()) != OGRERR_NONE)
        CPLError(CE_Failure, CPLE_AppDefined, "PROJ cannot read the coordinate reference system");
      system.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
      dataset->SetSpatialRef(&system);
    }
    dataset->GetRasterBand(1)->SetNoDataValue(no_data(type));
    dataset->GetRasterBand(1)->SetDescription(description.c_str());
    for (const auto& [name, text] : texts) dataset->SetMetadataItem(name.c_str(), text.c_str());
  });
}

// NewFile removes an unfinished file, so errors of GDAL do not matter here.
MosaicFile::~MosaicFile() {
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  open_->dataset.reset();
}

void MosaicFile::write(std::int64_t left, std::int64_t top, std::int64_t columns, std::int64_t rows,
                       std::vector<float> pixels) {
  const auto none = static_cast<float>(no_data(type_));
  for (float& pixel : pixels)
    if (std::isnan(pixel)) pixel = none;
  open_->with_gdal(file_, [&] {
    [[maybe_unused]] const CPLErr watched = open_->dataset->GetRasterBand(1)->RasterIO(
        GF_Write, static_cast<int>(left), static_cast<int>(top), static_cast<int>(columns),
        static_cast<int>(rows), pixels.data(), static_cast<int>(columns), static_cast<int>(rows),
        GDT_Float32, 0, 0, nullptr);
  });
}

bool MosaicFile::finish(const std::function<bool(double share)>& progress) {
  std::vector<int> levels;
  const int longest_px =
      std::max(open_->dataset->GetRasterXSize(), open_->dataset->GetRasterYSize());
  for (int level = 2; longest_px / (level / 2) > smallest_overview_px; level *= 2)
    levels.push_back(level);
  bool stopped = false;
  const std::function<bool(double)> watch = [&](double share) {
    stopped = stopped || !progress(share);
    return !stopped;
  };
  try {
    open_->with_gdal(file_, [&] {
      open_->dataset->FlushCache(false);
      if (!levels.empty())
        open_->dataset->BuildOverviews(
            type_ == PixelType::label ? "NEAREST" : "AVERAGE", static_cast<int>(levels.size()),
            levels.data(), 0, nullptr,
            [](double share, const char*, void* data) {
              return (*static_cast<const std::function<bool(double)>*>(data))(share) ? TRUE : FALSE;
            },
            const_cast<std::function<bool(double)>*>(&watch));
      open_->dataset.reset();
    });
  } catch (const std::runtime_error&) {
    if (!stopped) throw;  // GDAL reports a stop as an error
  }
  if (stopped) return false;
  new_file_.commit();
  return true;
}

}  // namespace ensonify::engine
