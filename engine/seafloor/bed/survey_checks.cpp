#include <ensonify/engine/seafloor/bed/survey_checks.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <system_error>

#include <Eigen/Core>
#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <ensonify/engine/base/lower_case.h>
#include <ensonify/engine/seafloor/bed/hdf5_handle-inl.h>
#include <ensonify/engine/seafloor/bed/reference_map.h>
#include <ensonify/engine/seafloor/bed/survey_formats.h>
#include <ensonify/refine/read_file.h>

namespace ensonify::engine {
namespace {

/// Whether a number is whole, except for the rounding of a file that prints few digits.
bool is_whole(double number) {
  return number > 0.5 && std::abs(number - std::round(number)) < 1e-4 * number;
}

/// Whether a grid without a reference looks like one of longitudes and latitudes.
bool seems_in_degrees(const std::array<double, 6>& transform, int columns) {
  const auto [west, east_step, turn_1, north, turn_2, north_step] = transform;
  // Cells of whole arc seconds, but not of whole millimetres: a size in metres would be unusual.
  const bool seconds =
      east_step < 0.1 && is_whole(3600.0 * east_step) && !is_whole(1000.0 * east_step);
  return (east_step < 0.005 || seconds) && std::abs(north_step) < 0.1 && west >= -180.0 &&
         west + east_step * columns <= 360.0 && std::abs(north) <= 90.0;
}

/// Whether a word is a number. A number beyond the range of a double is one, too.
bool is_number(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error != std::errc::invalid_argument && end == word.data() + word.size();
}

/// For H5Lvisit(): returns 1, which ends the visit, at a link or a table whose content is in
/// another file, and sets `found` to its name.
herr_t is_elsewhere(hid_t group, const char* name, const H5L_info_t* link, void* found) {
  bool elsewhere = link->type == H5L_TYPE_EXTERNAL;
  if (link->type == H5L_TYPE_HARD) {
    const Hdf5Handle object(H5Oopen(group, name, H5P_DEFAULT), H5Oclose);
    if (object.is_open() && H5Iget_type(object.get()) == H5I_DATASET) {
      const Hdf5Handle made_with(H5Dget_create_plist(object.get()), H5Pclose);
      elsewhere = made_with.is_open() && (H5Pget_external_count(made_with.get()) > 0 ||
                                          H5Pget_layout(made_with.get()) == H5D_VIRTUAL);
    }
  }
  if (elsewhere) *static_cast<std::string*>(found) = name;
  return elsewhere ? 1 : 0;
}

}  // namespace

std::string fault_of_size(GDALRasterBand& band, std::optional<double> file_bytes, bool is_text) {
  const int columns = band.GetXSize(), rows = band.GetYSize();
  if (columns < 2 || rows < 2)
    return fmt::format("has {} x {} cells; a seafloor needs at least 2 x 2", columns, rows);
  if (!file_bytes) return {};
  const double cells = static_cast<double>(columns) * rows, bytes = *file_bytes;
  int block_columns = 0, block_rows = 0;
  band.GetBlockSize(&block_columns, &block_rows);
  const double block = static_cast<double>(block_columns) * block_rows;
  if (cells > (is_text ? 0.5 * (bytes + 1.0) : 1000.0 * bytes) || block > 1000.0 * bytes)
    return fmt::format(
        "promises {} x {} cells, which a file of {:.0f} bytes cannot hold; it is truncated or its "
        "header is wrong",
        columns, rows, bytes);
  return {};
}

std::string fault_of_transform(const std::array<double, 6>& transform, int columns, int rows) {
  const auto [west, east_step, turn_1, north, turn_2, north_step] = transform;
  if (!std::ranges::all_of(transform, [](double x) { return std::isfinite(x); }) ||
      !(east_step > 0.0) || north_step == 0.0)
    return fmt::format("has cells of {} x {} m, expected positive sizes; {}", east_step, north_step,
                       east_step < 0.0 ? "make it north-up with gdalwarp"
                                       : "give it the right corners with gdal_translate -a_ullr");
  if (std::abs(turn_1) * rows > 1e-3 * east_step ||
      std::abs(turn_2) * columns > 1e-3 * std::abs(north_step))
    return "is a grid rotated against north; make it north-up with gdalwarp";
  return {};
}

std::string fault_of_reference(GDALDataset& dataset, GDALRasterBand& band,
                               const std::filesystem::path& file,
                               const std::array<double, 6>& transform, bool cell_is_given) {
  const char* const remedy =
      "project it to metres, with gdalwarp -t_srs EPSG:326NN for UTM zone NN";
  const auto [west, east_step, turn_1, north, turn_2, north_step] = transform;
  const int columns = band.GetXSize(), rows = band.GetYSize();
  const OGRSpatialReference* reference = dataset.GetSpatialRef();
  if (reference && reference->IsGeographic()) return fmt::format("is in degrees; {}", remedy);
  if (std::string_view(dataset.GetDriverName()) == "netCDF")
    if (const char* const variable = band.GetMetadataItem("NETCDF_VARNAME"))
      if (std::string fault = fault_of_netcdf_axes(file, variable); !fault.empty()) return fault;
  if (reference && std::abs(reference->GetLinearUnits() - 1.0) > 1e-9)
    return fmt::format("has cells in units of {} m; {}", reference->GetLinearUnits(), remedy);
  constexpr double max_off = 0.05;  // most error of a length; on maps of a continent it is smaller
  const Eigen::Vector2d middle(west + 0.5 * east_step * columns, north + 0.5 * north_step * rows);
  if (reference && !is_on_map(wkt_of(*reference), middle))
    return fmt::format(
        "lies at {:.0f} m east and {:.0f} m north, off the map of its coordinate reference system; "
        "declare the right one with gdal_edit.py -a_srs",
        middle.x(), middle.y());
  if (const auto scale =
          reference ? scale_of_reference(wkt_of(*reference), middle) : std::optional<double>();
      scale && std::abs(*scale - 1.0) > max_off)
    return fmt::format("has map metres that are {:.2f} m on Earth, as Mercator's; {}", *scale,
                       remedy);
  if (!reference && !cell_is_given && seems_in_degrees(transform, columns))
    return fmt::format(
        "seems to be in degrees, with cells of {}; {}. If they are metres, declare that with "
        "gdal_translate -a_srs",
        east_step, remedy);
  if (const char* unit = nullptr;
      reference && reference->IsCompound() &&
      std::abs(reference->GetTargetLinearUnits("VERT_CS", &unit) - 1.0) > 1e-9)
    return fmt::format(
        "has heights in '{}' by its reference system; convert them to metres with "
        "gdal_calc.py",
        unit ? unit : "another unit");
  const std::string unit = band.GetUnitType();
  if (!is_metre(unit))
    return fmt::format("has heights in '{}'; convert them to metres with gdal_calc.py", unit);
  return {};
}

std::string fault_of_ascii_grid(const std::filesystem::path& file, int columns, int rows) {
  refine::FileReader in(file);
  const std::size_t promised = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  std::size_t found = 0, line_number = 0;
  for (std::string line; in.next_line(line);) {
    ++line_number;
    constexpr const char* blank = " \t\r\v\f";
    std::size_t begin = line.find_first_not_of(blank);
    for (; begin != std::string::npos; begin = line.find_first_not_of(blank, begin)) {
      const std::size_t end = std::min(line.find_first_of(blank, begin), line.size());
      const std::string_view word = std::string_view(line).substr(begin, end - begin);
      if (!is_number(word)) {
        // Lines of the header begin with a word and end with a digit.
        if (found == 0 && !std::isdigit(static_cast<unsigned char>(word.back()))) break;
        return fmt::format("line {}: '{}' is not a number{}", line_number, word.substr(0, 40),
                           word.find(',') == word.npos ? "" : ", expected a decimal point");
      }
      if (found == 0 && (word.starts_with('n') || word.starts_with('N')))  // GDAL would skip it
        return fmt::format(
            "line {}: a first height of '{}' cannot be read; write a number there, such as the "
            "value of NODATA_value",
            line_number, word);
      ++found;
      begin = end;
    }
  }
  if (found == promised) return {};
  return fmt::format(
      "holds {} heights where its header promises {} x {} = {}; it is truncated or its header is "
      "wrong",
      found, columns, rows, promised);
}

std::string fault_of_hdf5(const std::filesystem::path& file) {
  const Hdf5Handle all(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  std::string found;
  if (all.is_open()) H5Lvisit(all.get(), H5_INDEX_NAME, H5_ITER_NATIVE, is_elsewhere, &found);
  if (found.empty()) return {};
  return fmt::format(
      "has the content of '{}' in another file; put it into this one (h5repack, or "
      "gdal_translate to a GeoTIFF)",
      found);
}

bool is_metre(std::string_view unit) {
  constexpr std::array<std::string_view, 6> names = {"", "m", "metre", "metres", "meter", "meters"};
  return std::ranges::find(names, lower_case(std::string(unit))) != names.end();
}

int utm_zone(GDALDataset& dataset) {
  const OGRSpatialReference* reference = dataset.GetSpatialRef();
  if (!reference || std::abs(reference->GetSemiMajor() - 6378137.0) > 1e-3 ||
      std::abs(reference->GetInvFlattening() - 298.2572) > 1e-4)
    return 0;
  int north = 1;
  const int zone = reference->GetUTMZone(&north);
  return north ? zone : -zone;
}

}  // namespace ensonify::engine
