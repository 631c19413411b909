#include <ensonify/engine/seafloor/bed/survey.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>

#include <cpl_conv.h>
#include <cpl_error.h>
#include <cpl_string.h>
#include <fmt/format.h>
#include <gdal_priv.h>
#include <hdf5.h>
#include <ogr_spatialref.h>

#include <ensonify/engine/base/lower_case.h>
#include <ensonify/engine/base/random.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/engine/seafloor/bed/files_beside.h>
#include <ensonify/engine/seafloor/bed/refuse_file.h>
#include <ensonify/engine/seafloor/bed/soundings.h>
#include <ensonify/engine/seafloor/bed/survey_checks.h>
#include <ensonify/engine/seafloor/bed/survey_formats.h>
#include <ensonify/engine/seafloor/bed/unmarked_grid.h>
#include <ensonify/engine/seafloor/bed/variable_resolution.h>
#include <ensonify/refine/mesh_reader.h>
#include <ensonify/refine/read_file.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {
namespace {

constexpr double max_survey_cells = 1073741824.0;  // 2^30
constexpr std::array<const char*, 2> vrt_driver = {"VRT", nullptr};

class SurveyReader {
 public:
  SurveyReader(const SurveyFile& file, double water_level_m, const SurveyScatter& scatter = {})
      : file_(file.path),
        cell_m_(file.cell_m),
        water_level_m_(water_level_m),
        scatter_(scatter),
        beside_(file_),
        may_use_hdf5_(is_hdf5(file_) || is_mosaic(file_)) {}
  ~SurveyReader() {
    const Quiet quiet(*this);
    resolution_.reset();
    dataset_.reset();
  }
  SurveyReader(const SurveyReader&) = delete;
  SurveyReader& operator=(const SurveyReader&) = delete;

  /// The source files of a mosaic; none if the file is no mosaic.
  std::vector<std::filesystem::path> sources() {
    if (!is_mosaic(file_)) return {};
    const Quiet quiet(*this);
    GDALAllRegister();
    return files_of_mosaic(file_);
  }

  Heightfield header() {
    const Quiet quiet(*this);
    return read_header();
  }

  Heightfield read(const std::function<void()>& stop_check) {
    const Quiet quiet(*this);
    prepare();
    read_heights(stop_check);
    for (int row = 0; row + 1 < field_.rows; ++row)
      for (int column = 0; column + 1 < field_.columns; ++column)
        if (field_.whole(column, row)) return std::move(field_);
    fail("no cell has heights at all four corners; is the NODATA value right (see gdalinfo)?");
  }

  /// A window's heights, row by row from the south. Thread-safe, if no other function is called.
  void read_window(int first_column, int first_row, int columns, int rows, std::span<double> z_m) {
    const std::lock_guard lock(mutex_);
    const Quiet quiet(*this);
    if (!prepared_) {
      prepare();
      keep_rows_in_cache();
      prepared_ = true;
    }
    const Window window{first_column, first_row, columns, rows};
    read_raw(window, z_m);
    if (scatter_.of_uncertainty > 0.0) scatter(window, z_m);
  }

 private:
  using Window = VariableResolution::Window;

  /// Converts a band's numbers to metres.
  struct Metres {
    double scale = 1.0, offset_m = 0.0;
    double operator()(double raw) const { return scale * raw + offset_m; }
  };
  static Metres metres_of(GDALRasterBand& band) {
    Metres metres;
    int is_given = 0;
    if (const double scale = band.GetScale(&is_given); is_given) metres.scale = scale;
    if (const double offset_m = band.GetOffset(&is_given); is_given) metres.offset_m = offset_m;
    return metres;
  }

  /// Reads a window of a band, row by row from the south.
  void read_band(GDALRasterBand& from, const Window& window, std::span<double> values) {
    const auto [first_column, first_row, columns, rows] = window;
    const bool from_north = transform_[5] < 0.0;
    const int first_line = from_north ? field_.rows - first_row - rows : first_row;
    // If the file's rows go south, GDAL writes from the last row of `values` to the first.
    double* const first =
        from_north ? &values[static_cast<std::size_t>(rows - 1) * static_cast<std::size_t>(columns)]
                   : values.data();
    const GSpacing step = GSpacing{sizeof(double)} * columns * (from_north ? -1 : 1);
    if (from.RasterIO(GF_Read, first_column, first_line, columns, rows, first, columns, rows,
                      GDT_Float64, sizeof(double), step, nullptr) != CE_None ||
        !gdal_error_.empty())
      fail_with_gdal(fmt::format(
          "{} of {} cannot be read; {}",
          rows == 1 ? fmt::format("row {}", first_line + 1)
                    : fmt::format("rows {} to {}", first_line + 1, first_line + rows),
          field_.rows,
          out_of_memory_ ? "there is not enough memory" : "the file is truncated or damaged"));
  }

  /// Reads the heights of a window from the file, without scatter.
  void read_raw(const Window& window, std::span<double> z_m) {
    if (resolution_)
      resolution_->read(VariableResolution::What::height, window, z_m);
    else
      read_band(band(), window, z_m);
    if (masked_) make_holes(window, z_m);
    const auto columns = static_cast<std::size_t>(window.columns);
    for (int row = 0; row < window.rows; ++row) {
      const int in_grid = window.first_row + row;
      to_heights(z_m.subspan(static_cast<std::size_t>(row) * columns, columns),
                 transform_[5] < 0.0 ? field_.rows - 1 - in_grid : in_grid, window.first_column);
    }
  }

  /// Sets NaN where the file's mask or transparency hides heights.
  void make_holes(const Window& window, std::span<double> z_m) {
    std::vector<double> mask(z_m.size());
    read_band(*band().GetMaskBand(), window, mask);
    for (std::size_t i = 0; i < mask.size(); ++i)
      if (mask[i] == 0.0) z_m[i] = std::numeric_limits<double>::quiet_NaN();
  }

  /// Reads the uncertainties of a window's heights. Where the file has none, they are not positive.
  void read_uncertainty(const Window& window, std::span<double> uncertainty_m) {
    if (resolution_)
      return resolution_->read(VariableResolution::What::uncertainty, window, uncertainty_m);
    const int number = band_of_uncertainty();
    if (number == 0)
      fail(
          "has no band with the uncertainty of its heights; leave seafloor.uncertainty_scatter out");
    GDALRasterBand& band = *dataset_->GetRasterBand(number);
    read_band(band, window, uncertainty_m);
    int has_nodata = 0;
    const double nodata = band.GetNoDataValue(&has_nodata);
    const Metres metres = metres_of(band);
    for (double& raw : uncertainty_m) raw = has_nodata && raw == nodata ? 0.0 : metres(raw);
  }

  void scatter(const Window& window, std::span<double> z_m) {
    std::vector<double> uncertainty_m(z_m.size()), draws(static_cast<std::size_t>(window.columns));
    read_uncertainty(window, uncertainty_m);
    for (int row = 0; row < window.rows; ++row) {
      RandomStream(scatter_.seed, Purpose::survey_scatter,
                   {static_cast<std::uint64_t>(window.first_row + row)})
          .normal(draws, static_cast<std::uint64_t>(window.first_column));
      const std::size_t begin = static_cast<std::size_t>(row) * draws.size();
      for (std::size_t i = 0; i < draws.size(); ++i)
        if (const double sigma_m = uncertainty_m[begin + i];
            sigma_m > 0.0 && sigma_m <= max_height_m)
          z_m[begin + i] += scatter_.of_uncertainty * sigma_m * draws[i];
    }
  }

  void scatter_all() {
    constexpr int strip_rows = 512;
    for (int row = 0; scatter_.of_uncertainty > 0.0 && row < field_.rows; row += strip_rows) {
      const Window strip{0, row, field_.columns, std::min(strip_rows, field_.rows - row)};
      scatter(strip,
              std::span(field_.z_m).subspan(field_.index(0, row), field_.index(0, strip.rows)));
    }
  }

  Heightfield read_header() {
    open();
    check_size();
    check_reference();
    if (has_refinements(*dataset_)) take_refinements();
    place();
    return field_;
  }

  /// Uses a grid with the cells of the finest refinement instead of the coarse grid.
  void take_refinements() {
    if (!resolution_) resolution_.emplace(file_, transform_[1], std::abs(transform_[5]));
    const double columns = resolution_->columns(), rows = resolution_->rows();
    check_points(columns, rows);
    const double south =
        std::min(transform_[3], transform_[3] + dataset_->GetRasterYSize() * transform_[5]);
    field_.columns = static_cast<int>(columns);
    field_.rows = static_cast<int>(rows);
    transform_ = {transform_[0], resolution_->cell_m(), 0.0, south, 0.0, resolution_->cell_m()};
  }

  /// Reads the header and the rules for heights. Call this before heights are read.
  void prepare() {
    if (!std::isfinite(water_level_m_)) fail("the water level is not a finite number");
    read_header();
    gdal_error_.clear();  // messages about a file that GDAL could open are warnings
    if (resolution_) return;
    if (soundings_) take_soundings();
    if (is_text()) refuse(fault_of_ascii_grid(file_, field_.columns, field_.rows));
    nodata_ = band().GetNoDataValue(&has_nodata_);
    declares_nodata_ = has_nodata_ != 0;
    if (is_text() && !has_nodata_) {  // the default of ESRI's format
      has_nodata_ = 1;
      nodata_ = -usual_missing_m;
    }
    masked_ = (band().GetMaskFlags() & (GMF_PER_DATASET | GMF_ALPHA)) != 0;
    height_m_ = metres_of(band());
    // Blocks that were never written read as zeros, unless a NODATA value fills them.
    if (!has_nodata_ && (band().GetDataCoverageStatus(0, 0, field_.columns, field_.rows,
                                                      GDAL_DATA_COVERAGE_STATUS_EMPTY, nullptr) &
                         GDAL_DATA_COVERAGE_STATUS_EMPTY))
      fail(
          "has blocks without data and no NODATA value for them; it is damaged, or needs "
          "gdal_edit.py -a_nodata");
    gdal_error_.clear();
  }

  void take_soundings() {
    std::vector<double> heights_m = soundings_->heights();
    if (band().RasterIO(GF_Write, 0, 0, field_.columns, field_.rows, heights_m.data(),
                        field_.columns, field_.rows, GDT_Float64, 0, 0, nullptr) != CE_None)
      fail_with_gdal("cannot be put on a grid; is there enough memory?");
  }

  /// In files that store whole rows together, windows side by side need the same rows.
  void keep_rows_in_cache() {
    constexpr std::int64_t rows = 1400, most_bytes = 256 << 20;
    const std::int64_t row_bytes =
        std::int64_t{field_.columns} * GDALGetDataTypeSizeBytes(band().GetRasterDataType());
    GDALSetCacheMax64(std::clamp(rows * row_bytes, gdal_cache_bytes, most_bytes));
  }

  GDALRasterBand& band() { return *dataset_->GetRasterBand(band_); }

  /// Whether a band's name has one of these words.
  bool band_has(int number, std::initializer_list<std::string_view> words) const {
    const std::string name = lower_case(dataset_->GetRasterBand(number)->GetDescription());
    return std::ranges::any_of(words,
                               [&](std::string_view word) { return name.find(word) != name.npos; });
  }
  bool is_uncertainty(int number) const {
    return band_has(number, {"uncertainty", "error", "deviation", "std"});
  }
  /// The first band with a name for heights, or else the first band.
  int band_of_heights() const {
    for (int number = 1; number <= dataset_->GetRasterCount(); ++number)
      if (band_has(number, {"elevation", "depth", "height", "bathymetry"}) &&
          !is_uncertainty(number))
        return number;
    return 1;
  }
  /// The first band with a name for uncertainties; 0 if there is none.
  int band_of_uncertainty() const {
    for (int number = 1; number <= dataset_->GetRasterCount(); ++number)
      if (is_uncertainty(number)) return number;
    return 0;
  }

  [[noreturn]] void fail(const std::string& what) const { refuse_file(file_, what); }
  void refuse(const std::string& fault) const {
    if (!fault.empty()) fail(fault);
  }
  [[noreturn]] void fail_with_gdal(const std::string& what) const {
    fail(gdal_error_.empty() ? what : fmt::format("{} ({})", what, gdal_error_));
  }

  // Keeps GDAL's first error, nearest to the cause, and PROJ's first message, which is a warning.
  static void CPL_STDCALL on_gdal_error(CPLErr severity, CPLErrorNum number, const char* message) {
    auto& reader = *static_cast<SurveyReader*>(CPLGetErrorHandlerUserData());
    reader.out_of_memory_ = reader.out_of_memory_ || number == CPLE_OutOfMemory;
    if (severity >= CE_Failure && reader.gdal_error_.empty()) reader.gdal_error_ = message;
    if (std::string_view(message).starts_with("PROJ") && reader.proj_message_.empty())
      reader.proj_message_ = message;
  }

  void open() {
    refine::require_file<refine::MeshError>(file_);
    bytes_ = static_cast<double>(std::filesystem::file_size(file_));
    if (bytes_ == 0.0) fail("the file is empty");
    if (refine::is_utf16(refine::begin_of_file(file_, 4))) fail(std::string(refine::utf16_fault));
    // Otherwise HDF5 would print messages on this thread for a damaged BAG.
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    [[maybe_unused]] static const bool registered = (GDALAllRegister(), true);
    if (is_hdf5(file_)) refuse(fault_of_hdf5(file_));
    if (refine::begins_with(file_, "\x93NUMPY")) {
      require_cell("an .npy file, which has no cell size");
      open_as(vrt_of_npy(file_, cell_m_), vrt_driver.data());
    } else if (is_mosaic(file_)) {
      bytes_ = 0.0;
      for (const std::filesystem::path& source : files_of_mosaic(file_))
        bytes_ += static_cast<double>(std::filesystem::file_size(source));
      open_as(std::filesystem::absolute(file_), vrt_driver.data());
    } else if (!GDALIdentifyDriverEx(std::filesystem::absolute(file_).c_str(), GDAL_OF_RASTER,
                                     survey_drivers.data(), nullptr) &&
               are_soundings(file_)) {
      require_cell("a list of soundings, which are put on a grid");
      soundings_.emplace(file_, cell_m_);
      open_grid_of_soundings();
    } else {
      open_file();
    }
    if (const std::optional found = seafloor_file(file_);
        !dataset_ && found && found->kind != "survey")
      throw refine::MeshError(fault_of_kind(file_, *found, "a survey grid"));
    if (!dataset_) refuse(refine::fault_of_other_mesh(file_));
    if (!dataset_)
      fail_with_gdal(
          "cannot be read as GeoTIFF, BAG, ESRI ASCII grid, netCDF, VRT, .npy or lines of x y z; is "
          "it whole? gdal_translate makes a GeoTIFF of most other grids");
    if (names_overviews(*dataset_))
      fail("names another file with its overviews; write it again with gdal_translate");
    if (dataset_->GetRasterCount() < 1)
      fail("does not hold a single grid; extract one with gdal_translate (gdalinfo lists them)");
    band_ = band_of_heights();
    if (cell_m_ > 0.0 && !needs_cell_)
      fail(fmt::format("states the size of its cells; leave {} out", cell_key));
  }

  void require_cell(std::string_view of) {
    needs_cell_ = true;
    if (!(cell_m_ > 0.0)) fail(fmt::format("is {}; set {}", of, cell_key));
  }

  void open_as(const std::string& name, const char* const* by) {
    dataset_.reset(
        GDALDataset::Open(name.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, by, nullptr, nullptr));
  }

  void open_file() {
    // An absolute name cannot begin with a prefix that GDAL interprets ("NETCDF:...").
    open_as(std::filesystem::absolute(file_), survey_drivers.data());
    if (dataset_ || !refine::begins_with(file_, "\xef\xbb\xbf")) return;
    unmarked_ = std::make_unique<UnmarkedGrid>(file_, beside_.read());
    gdal_error_.clear();
    open_as(unmarked_->name(), survey_drivers.data());
  }

  /// Makes a grid in memory; prepare() adds its heights.
  void open_grid_of_soundings() {
    dataset_.reset(GetGDALDriverManager()->GetDriverByName("MEM")->Create(
        "", soundings_->columns, soundings_->rows, 1, GDT_Float64, nullptr));
    std::array<double, 6> transform{soundings_->west_m,  cell_m_, 0.0,
                                    soundings_->south_m, 0.0,     cell_m_};
    if (dataset_) dataset_->SetGeoTransform(transform.data());
  }

  bool is_text() const { return std::string_view(dataset_->GetDriverName()) == "AAIGrid"; }

  void check_size() {
    field_.columns = dataset_->GetRasterXSize();
    field_.rows = dataset_->GetRasterYSize();
    refuse(fault_of_size(band(), soundings_ ? std::nullopt : std::optional(bytes_), is_text()));
    check_points(field_.columns, field_.rows);
  }
  void check_points(double columns, double rows) const {
    if (columns * rows > max_survey_cells)
      fail(fmt::format("has {} x {} cells, more than 2^30; {}", columns, rows,
                       how_to_make_smaller(columns * rows)));
  }

  std::string how_to_make_smaller(double cells) const {
    if (!resolution_)
      return "make it coarser with gdalwarp -tr or cut a part out with gdal_translate -projwin";
    const double cell_m = resolution_->cell_m() * std::ceil(std::sqrt(cells / max_survey_cells));
    return fmt::format(
        "make a coarser GeoTIFF with gdal_translate -oo MODE=RESAMPLED_GRID -oo RESX={0} -oo "
        "RESY={0}",
        cell_m);
  }

  [[noreturn]] void fail_without_reference() const {
    fail(
        fmt::format("its coordinate reference system cannot be read ({}); does PROJ find its "
                    "database (PROJ_DATA), and is there enough memory?",
                    proj_message_.empty() ? "no reason given" : proj_message_));
  }

  void check_reference() {
    if (dataset_->GetGeoTransform(transform_.data()) != CE_None)
      fail("does not define where its cells lie; add that with gdal_translate -a_ullr");
    refuse(fault_of_transform(transform_, field_.columns, field_.rows));
    if (!dataset_->GetSpatialRef() && !proj_message_.empty()) fail_without_reference();
    refuse(fault_of_reference(*dataset_, band(), file_, transform_, needs_cell_));
  }

  void place() {
    const auto [west, east_step, turn_1, north, turn_2, north_step] = transform_;
    field_.cell_east_m = east_step;
    field_.cell_north_m = std::abs(north_step);
    field_.world_origin = {west + 0.5 * field_.columns * east_step,
                           north + 0.5 * field_.rows * north_step, water_level_m_};
    field_.utm_zone = utm_zone(*dataset_);
    if (const OGRSpatialReference* reference = dataset_->GetSpatialRef()) {
      field_.reference = wkt_of(*reference);
      if (field_.reference.empty()) fail_without_reference();
    }
  }

  void read_heights(const std::function<void()>& stop_check) {
    if (resolution_) {
      field_.z_m.resize(static_cast<std::size_t>(field_.points()));
      read_raw({0, 0, field_.columns, field_.rows}, field_.z_m);
      return scatter_all();
    }
    const bool from_north = transform_[5] < 0.0;
    // By rows, so that memory grows with the rows in the file, not with the size in its header.
    for (int line = 0; line < field_.rows; ++line) {
      if (stop_check) stop_check();
      const std::size_t begin = field_.z_m.size();
      field_.z_m.resize(begin + static_cast<std::size_t>(field_.columns));
      read_raw({0, from_north ? field_.rows - 1 - line : line, field_.columns, 1},
               std::span(field_.z_m).subspan(begin));
    }
    if (from_north)  // the file's first row is the northern one
      for (int south = 0, north = field_.rows - 1; south < north; ++south, --north)
        std::swap_ranges(field_.z_m.data() + field_.index(0, south),
                         field_.z_m.data() + field_.index(0, south) + field_.columns,
                         field_.z_m.data() + field_.index(0, north));
    scatter_all();
  }

  /// Converts a part of a line of the file to heights, in place.
  void to_heights(std::span<double> row, int line, int first_column) const {
    for (std::size_t i = 0; i < row.size(); ++i) {
      const double raw = row[i];
      // Files print their NODATA value with few digits.
      const bool hole = !std::isfinite(raw) ||
                        (has_nodata_ && std::abs(raw - nodata_) <= 1e-6 * std::abs(nodata_));
      const double height = height_m_(raw);
      const bool suspect = !declares_nodata_ && std::abs(raw) == usual_missing_m;
      if (!hole && (suspect || !(std::abs(height) <= max_height_m)))
        fail(fmt::format("row {}, column {}: a height of {} m; if it marks missing data, {}",
                         line + 1, static_cast<std::size_t>(first_column) + i + 1, height,
                         how_to_declare(raw)));
      row[i] = hole ? std::numeric_limits<double>::quiet_NaN() : height - water_level_m_;
    }
  }

  std::string how_to_declare(double missing) const {
    const std::string_view driver = dataset_->GetDriverName();
    if (driver == "AAIGrid")
      return fmt::format("declare it in the header, with a line NODATA_value {}", missing);
    if (needs_cell_) return "make it NaN";
    if (driver == "GTiff") return fmt::format("declare it with gdal_edit.py -a_nodata {}", missing);
    return fmt::format("make a GeoTIFF that declares it, with gdal_translate -a_nodata {}",
                       missing);
  }

  /// HDF5 is not safe for threads. VariableResolution cannot take the lock inside GDAL, so this
  /// lock is for both.
  inline static std::mutex use_of_hdf5;

  /// GDAL's settings for the thread while a survey is read: messages go to the reader and not to
  /// stderr; an .aux.xml file is read if it was checked; heights of text grids are doubles.
  struct Quiet {
    explicit Quiet(SurveyReader& reader)
        : alone(reader.may_use_hdf5_ ? std::unique_lock(use_of_hdf5)
                                     : std::unique_lock<std::mutex>()),
          handler(on_gdal_error, &reader),
          metadata("GDAL_PAM_ENABLED", reader.beside_.reads_metadata(), false) {}
    std::unique_lock<std::mutex> alone;
    CPLErrorHandlerPusher handler;
    CPLConfigOptionSetter metadata;
    CPLConfigOptionSetter fractions{"AAIGRID_DATATYPE", "Float64", false};
    // Later releases of GDAL need this for a VRT of raw bytes. Only vrt_of_npy() makes such a VRT.
    CPLConfigOptionSetter npy{"GDAL_VRT_RAWRASTERBAND_ALLOWED_SOURCE", "ALL", false};
  };

  std::string gdal_error_, proj_message_;
  const std::filesystem::path file_;
  const double cell_m_;
  const double water_level_m_;
  SurveyScatter scatter_;
  const FilesBeside beside_;
  std::optional<VariableResolution> resolution_;
  std::optional<Soundings> soundings_;
  std::mutex mutex_;  // of read_window()
  double nodata_ = 0.0;
  Metres height_m_;
  double bytes_ = 0.0;
  std::unique_ptr<UnmarkedGrid> unmarked_;
  std::unique_ptr<GDALDataset> dataset_;
  std::array<double, 6> transform_{};
  Heightfield field_;
  int band_ = 1, has_nodata_ = 0;
  const bool may_use_hdf5_;
  bool out_of_memory_ = false, needs_cell_ = false;
  bool prepared_ = false, declares_nodata_ = false, masked_ = false;
};

}  // namespace

std::vector<std::filesystem::path> files_behind(const std::filesystem::path& file) {
  const auto place_of = [](const std::filesystem::path& named) {
    return std::filesystem::absolute(named).lexically_normal();
  };
  const std::filesystem::path its_place = place_of(file), folder = its_place.parent_path();
  std::set<std::filesystem::path> files;
  const auto take = [&](const std::filesystem::path& named) {
    std::filesystem::path place = place_of(named);
    // A mosaic may name a source by another path to the same folder.
    if (place != its_place && std::ranges::mismatch(folder, place).in1 == folder.end())
      files.insert(std::move(place));
  };
  for (const std::filesystem::path& source : SurveyReader(file, 0.0).sources()) {
    take(source);
    std::ranges::for_each(files_behind(source), take);
  }
  std::ranges::for_each(FilesBeside(file).read(), take);
  return {files.begin(), files.end()};
}

SurveySample sample_survey(const SurveyFile& file, double water_level_m) {
  SurveyReader reader(file, water_level_m);
  const Heightfield grid = reader.header();
  SurveySample sample;
  double sum_m = 0.0;
  std::size_t count = 0;
  // If the first places have no heights, more places are read.
  for (int places = 8; count == 0 && places <= 64; places *= 8)
    for (int row = 0; row < places; ++row)
      for (int column = 0; column < places; ++column) {
        constexpr int side = 32;
        const int columns = std::min(side, grid.columns), rows = std::min(side, grid.rows);
        const auto first = [&](int place, int points, int taken) {
          return static_cast<int>((place + 0.5) / places * (points - taken));
        };
        Heightfield& part = sample.parts.emplace_back(grid);
        part.columns = columns;
        part.rows = rows;
        part.z_m.resize(static_cast<std::size_t>(part.points()));
        reader.read_window(first(column, grid.columns, columns), first(row, grid.rows, rows),
                           columns, rows, part.z_m);
        for (const double z : part.z_m) {
          if (std::isnan(z)) continue;
          sum_m += z;
          ++count;
          sample.lowest_m = std::min(sample.lowest_m, z);
          sample.highest_m = std::max(sample.highest_m, z);
        }
      }
  if (count == 0)
    throw refine::MeshError(fmt::format(
        "{}: has no heights at 4096 places all over it; is the NODATA value right (see gdalinfo)? "
        "If it is, cut the part with heights out with gdal_translate -projwin",
        file.path.string()));
  sample.mean_m = sum_m / static_cast<double>(count);
  return sample;
}

refine::HeightTiles::Heights survey_tiles(const SurveyFile& file, double water_level_m,
                                          const SurveyScatter& scatter) {
  const auto reader = std::make_shared<SurveyReader>(file, water_level_m, scatter);
  return [reader](int first_column, int first_row, int columns, int rows, std::span<double> z_m,
                  std::span<std::uint8_t>) {
    reader->read_window(first_column, first_row, columns, rows, z_m);
  };
}

Heightfield read_survey(const SurveyFile& file, double water_level_m, const SurveyScatter& scatter,
                        const std::function<void()>& stop_check) {
  return SurveyReader(file, water_level_m, scatter).read(stop_check);
}

std::string reference_about(const GeographicPlace& middle, const Eigen::Vector3d& world_origin) {
  OGRSpatialReference system;
  system.SetProjCS("metres about the seabed's middle");
  system.SetWellKnownGeogCS("WGS84");
  system.SetTM(middle.latitude_rad / degree, middle.longitude_rad / degree, 1.0, world_origin.x(),
               world_origin.y());
  return wkt_of(system);
}

Heightfield read_survey_header(const SurveyFile& file) { return SurveyReader(file, 0.0).header(); }

}  // namespace ensonify::engine
