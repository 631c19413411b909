#include <ensonify/engine/seafloor/bed/survey.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <cpl_conv.h>
#include <cpl_error.h>
#include <cpl_vsi.h>
#include <fmt/format.h>
#include <gdal_priv.h>
#include <hdf5.h>
#include <ogr_spatialref.h>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {
namespace {

// Only formats that keep the heights in one file: others (VRT, WMS) can name other files and hosts.
constexpr std::array<const char*, 5> drivers = {"GTiff", "BAG", "AAIGrid", "netCDF", nullptr};

// Beyond the deepest trench and the highest peak: larger values are undeclared NODATA values.
constexpr double highest_m = 12000.0;

std::string wkt_of(const OGRSpatialReference& reference) {
  constexpr std::array<const char*, 2> options = {"FORMAT=WKT2", nullptr};  // 1 lacks some systems
  char* text = nullptr;
  reference.exportToWkt(&text, options.data());
  const std::unique_ptr<char, void (*)(void*)> owned(text, VSIFree);
  return text ? text : "";
}

class SurveyReader {
 public:
  SurveyReader(const std::filesystem::path& file, double water_level_m)
      : file_(file), water_level_m_(water_level_m) {}

  std::string reference() {
    open();
    const OGRSpatialReference* reference = dataset_->GetSpatialRef();
    return reference ? wkt_of(*reference) : std::string();
  }

  Heightfield header() {
    open();
    GDALRasterBand& band = *dataset_->GetRasterBand(1);
    check_size(band);
    check_reference(band);
    place();
    return field_;
  }

  Heightfield read() {
    if (!std::isfinite(water_level_m_)) fail("the water level is not a finite number");
    header();
    if (is_text()) check_text();
    read_heights(*dataset_->GetRasterBand(1));
    for (int row = 0; row + 1 < field_.rows; ++row)
      for (int column = 0; column + 1 < field_.columns; ++column)
        if (field_.whole(column, row)) return std::move(field_);
    fail("no cell has heights at all four corners; is the NODATA value right (see gdalinfo)?");
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw refine::MeshError(fmt::format("{}: {}", file_.string(), what));
  }
  [[noreturn]] void fail_with_gdal(const std::string& what) const {
    fail(gdal_error_.empty() ? what : fmt::format("{} ({})", what, gdal_error_));
  }

  // Keeps GDAL's first message, which is nearest to the cause.
  static void CPL_STDCALL on_gdal_error(CPLErr severity, CPLErrorNum, const char* message) {
    auto& first = static_cast<SurveyReader*>(CPLGetErrorHandlerUserData())->gdal_error_;
    if (severity >= CE_Failure && first.empty()) first = message;
  }

  void open() {
    std::error_code error;
    if (!std::filesystem::is_regular_file(file_, error)) fail("there is no such file");
    bytes_ = static_cast<double>(std::filesystem::file_size(file_));
    if (bytes_ == 0.0) fail("the file is empty");
    // HDF5 would otherwise print, on this thread, for a damaged BAG.
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    [[maybe_unused]] static const bool registered = (GDALAllRegister(), true);
    // Absolute, so that no name is taken for one of GDAL's prefixes ("NETCDF:...").
    dataset_.reset(GDALDataset::Open(std::filesystem::absolute(file_).c_str(),
                                     GDAL_OF_RASTER | GDAL_OF_READONLY, drivers.data(), nullptr,
                                     nullptr));
    if (!dataset_)
      fail_with_gdal(
          "cannot be read as GeoTIFF, BAG, ESRI ASCII grid or netCDF; is it whole? gdal_translate "
          "makes a GeoTIFF of most other grids");
    if (dataset_->GetRasterCount() < 1)
      fail("does not hold a single grid; extract one with gdal_translate (gdalinfo lists them)");
  }

  bool is_text() const { return std::string_view(dataset_->GetDriverName()) == "AAIGrid"; }

  // Refuses headers that promise more cells than the file can hold, before anything is allocated:
  // a text cell needs two bytes, and no compression packs a thousand real heights into one byte.
  void check_size(GDALRasterBand& band) {
    field_.columns = dataset_->GetRasterXSize();
    field_.rows = dataset_->GetRasterYSize();
    if (field_.columns < 2 || field_.rows < 2)
      fail(fmt::format("has {} x {} cells; a seafloor needs at least 2 x 2", field_.columns,
                       field_.rows));
    const double cells = static_cast<double>(field_.columns) * field_.rows;
    int block_columns = 0, block_rows = 0;
    band.GetBlockSize(&block_columns, &block_rows);
    const double block = static_cast<double>(block_columns) * block_rows;
    if (cells > (is_text() ? 0.5 * (bytes_ + 1.0) : 1000.0 * bytes_) || block > 1000.0 * bytes_)
      fail(
          fmt::format("promises {} x {} cells, which a file of {:.0f} bytes cannot hold; it is "
                      "truncated or its header is wrong",
                      field_.columns, field_.rows, bytes_));
    if (cells > 1073741824.0)
      fail(
          fmt::format("has {} x {} cells, more than 2^30; make it coarser with gdalwarp -tr or cut "
                      "a part out with gdal_translate -projwin",
                      field_.columns, field_.rows));
  }

  void check_reference(GDALRasterBand& band) {
    if (dataset_->GetGeoTransform(transform_.data()) != CE_None)
      fail("does not define where its cells lie; add that with gdal_translate -a_ullr");
    const auto [west, east_step, turn_1, north, turn_2, north_step] = transform_;
    if (!std::all_of(transform_.begin(), transform_.end(),
                     [](double x) { return std::isfinite(x); }) ||
        !(east_step > 0.0) || north_step == 0.0)
      fail(fmt::format("has cells of {} x {} m, expected positive sizes", east_step, north_step));
    if (std::abs(turn_1) * field_.rows > 1e-3 * east_step ||
        std::abs(turn_2) * field_.columns > 1e-3 * std::abs(north_step))
      fail("is a grid rotated against north; make it north-up with gdalwarp");

    const char* const cure =
        "project it to metres, with gdalwarp -t_srs EPSG:326NN for UTM zone NN";
    const OGRSpatialReference* reference = dataset_->GetSpatialRef();
    if (reference && reference->IsGeographic()) fail(fmt::format("is in degrees; {}", cure));
    if (reference && std::abs(reference->GetLinearUnits() - 1.0) > 1e-9)
      fail(fmt::format("has cells in units of {} m; {}", reference->GetLinearUnits(), cure));
    // A grid without a reference that looks like longitudes and latitudes.
    if (!reference && east_step < 0.005 && std::abs(north_step) < 0.005 && west >= -180.0 &&
        west + east_step * field_.columns <= 360.0 && std::abs(north) <= 90.0)
      fail(fmt::format(
          "seems to be in degrees, with cells of {}; {}. If they are metres, declare that with "
          "gdal_translate -a_srs",
          east_step, cure));
    const std::string unit = band.GetUnitType();
    if (unit.find("ft") != std::string::npos || unit.find("oot") != std::string::npos ||
        unit.find("eet") != std::string::npos)
      fail(fmt::format("has heights in '{}'; convert them to metres with gdal_calc.py", unit));
  }

  // GDAL reads words as zeros and accepts a short last line, so each number is checked and counted
  // here.
  void check_text() const {
    std::ifstream in(file_, std::ios::binary);
    const std::size_t promised =
        static_cast<std::size_t>(field_.columns) * static_cast<std::size_t>(field_.rows);
    std::size_t found = 0, line_number = 0;
    for (std::string line; std::getline(in, line);) {
      ++line_number;
      constexpr const char* blank = " \t\r\v\f";
      std::size_t begin = line.find_first_not_of(blank);
      for (; begin != std::string::npos; begin = line.find_first_not_of(blank, begin)) {
        const std::size_t end = std::min(line.find_first_of(blank, begin), line.size());
        const std::string_view word = std::string_view(line).substr(begin, end - begin);
        if (!is_number(word)) {
          if (found == 0) break;  // the header's lines begin with words
          fail(fmt::format("line {}: '{}' is not a number", line_number, word.substr(0, 40)));
        }
        ++found;
        begin = end;
      }
    }
    if (!in.eof()) fail("cannot be read to its end");
    if (found != promised)
      fail(
          fmt::format("holds {} heights where its header promises {} x {} = {}; it is truncated or "
                      "its header is wrong",
                      found, field_.columns, field_.rows, promised));
  }

  static bool is_number(std::string_view word) {
    if (word.starts_with('+')) word.remove_prefix(1);
    double value = 0.0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error != std::errc::invalid_argument && end == word.data() + word.size();
  }

  void place() {
    const auto [west, east_step, turn_1, north, turn_2, north_step] = transform_;
    field_.cell_east_m = east_step;
    field_.cell_north_m = std::abs(north_step);
    field_.world_origin = {west + 0.5 * field_.columns * east_step,
                           north + 0.5 * field_.rows * north_step, water_level_m_};
    field_.utm_zone = utm_zone();
  }

  // Only for an ellipsoid within a millimetre of that of WGS 84 (such as GRS 80): datums that use
  // it (NAD83, ETRS89, GDA94) agree with WGS 84 within two metres, older ones do not.
  int utm_zone() const {
    const OGRSpatialReference* reference = dataset_->GetSpatialRef();
    if (!reference || std::abs(reference->GetSemiMajor() - 6378137.0) > 1e-3 ||
        std::abs(reference->GetInvFlattening() - 298.2572) > 1e-4)
      return 0;
    int north = 1;
    const int zone = reference->GetUTMZone(&north);
    return north ? zone : -zone;
  }

  void read_heights(GDALRasterBand& band) {
    int has_nodata = 0, has_scale = 0, has_offset = 0;
    const double nodata = band.GetNoDataValue(&has_nodata);
    double scale = band.GetScale(&has_scale), offset = band.GetOffset(&has_offset);
    if (!has_scale) scale = 1.0;
    if (!has_offset) offset = 0.0;
    // Blocks that were never written read as zeros, unless a NODATA value fills them.
    if (!has_nodata && (band.GetDataCoverageStatus(0, 0, field_.columns, field_.rows,
                                                   GDAL_DATA_COVERAGE_STATUS_EMPTY, nullptr) &
                        GDAL_DATA_COVERAGE_STATUS_EMPTY))
      fail(
          "has blocks without data and no NODATA value for them; it is damaged, or needs "
          "gdal_edit.py -a_nodata");

    gdal_error_.clear();  // warnings about a file that it could open
    // Memory grows with the rows that were read, not with the size in the header.
    for (int line = 0; line < field_.rows; ++line) {
      const std::size_t begin = field_.z_m.size();
      field_.z_m.resize(begin + static_cast<std::size_t>(field_.columns));
      double* const row = field_.z_m.data() + begin;
      if (band.RasterIO(GF_Read, 0, line, field_.columns, 1, row, field_.columns, 1, GDT_Float64, 0,
                        0, nullptr) != CE_None ||
          !gdal_error_.empty())
        fail_with_gdal(fmt::format("row {} of {} cannot be read; the file is truncated or damaged",
                                   line + 1, field_.rows));
      for (int column = 0; column < field_.columns; ++column) {
        const double raw = row[column];
        // Files print their NODATA value with few digits.
        const bool hole = !std::isfinite(raw) ||
                          (has_nodata && std::abs(raw - nodata) <= 1e-6 * std::abs(nodata));
        const double height = scale * raw + offset;
        if (!hole && !(std::abs(height) <= highest_m))
          fail(fmt::format(
              "row {}, column {}: a height of {} m; if it marks missing data, declare it with "
              "gdal_edit.py -a_nodata",
              line + 1, column + 1, height));
        row[column] = hole ? std::numeric_limits<double>::quiet_NaN() : height - water_level_m_;
      }
    }
    if (transform_[5] < 0.0)  // the file's first row is the northern one
      for (int south = 0, north = field_.rows - 1; south < north; ++south, --north)
        std::swap_ranges(field_.z_m.data() + field_.index(0, south),
                         field_.z_m.data() + field_.index(0, south) + field_.columns,
                         field_.z_m.data() + field_.index(0, north));
  }

  // This thread's GDAL settings while a survey is read: messages go to this class, not to stderr;
  // .aux.xml files are neither read nor written; a text grid keeps its fractions.
  std::string gdal_error_;
  CPLErrorHandlerPusher handler_{on_gdal_error, this};
  CPLConfigOptionSetter no_sidecars_{"GDAL_PAM_ENABLED", "NO", false};
  CPLConfigOptionSetter fractions_{"AAIGRID_DATATYPE", "Float64", false};

  const std::filesystem::path& file_;
  double water_level_m_;
  double bytes_ = 0.0;
  std::unique_ptr<GDALDataset> dataset_;
  std::array<double, 6> transform_{};
  Heightfield field_;
};

}  // namespace

Heightfield read_survey(const std::filesystem::path& file, double water_level_m) {
  return SurveyReader(file, water_level_m).read();
}

std::string survey_reference(const std::filesystem::path& file) {
  return SurveyReader(file, 0.0).reference();
}

std::string reference_about(const GeographicPlace& middle, const Eigen::Vector3d& world_origin) {
  constexpr double degree = std::numbers::pi / 180.0;
  OGRSpatialReference system;
  system.SetProjCS("metres about the seabed's middle");
  system.SetWellKnownGeogCS("WGS84");
  system.SetTM(middle.latitude_rad / degree, middle.longitude_rad / degree, 1.0, world_origin.x(),
               world_origin.y());
  return wkt_of(system);
}

Heightfield read_survey_header(const std::filesystem::path& file) {
  return SurveyReader(file, 0.0).header();
}

}  // namespace ensonify::engine
