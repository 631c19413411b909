#include <ensonify/engine/seafloor/bed/survey_checks.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include <fmt/format.h>
#include <gdal_priv.h>

#include <ensonify/engine/base/lower_case.h>

namespace ensonify::engine {
namespace {

/// A text attribute in lower case; empty if there is none.
std::string attribute_of(const GDALMDArray& array, const char* name) {
  const auto attribute = array.GetAttribute(name);
  const char* const text = attribute ? attribute->ReadAsString() : nullptr;
  return lower_case(text ? text : "");
}

/// The direction of a coordinate, 'x' or 'y', from its standard_name, axis or name; 0: unknown.
char direction_of(const GDALMDArray& coordinate) {
  const std::string standard = attribute_of(coordinate, "standard_name");
  const std::string name = lower_case(coordinate.GetName());
  const auto begins = [](std::string_view text, auto... words) {
    return (text.starts_with(words) || ...);
  };
  if (begins(standard, "projection_x", "longitude", "grid_longitude")) return 'x';
  if (begins(standard, "projection_y", "latitude", "grid_latitude")) return 'y';
  const std::string axis = attribute_of(coordinate, "axis");
  if (axis == "x" || axis == "y") return axis.front();
  if (name == "x" || begins(name, "lon", "east")) return 'x';
  if (name == "y" || begins(name, "lat", "north")) return 'y';
  return 0;
}

bool is_in_degrees(const GDALMDArray& coordinate) {
  const std::string name = lower_case(coordinate.GetName());
  const std::string standard = attribute_of(coordinate, "standard_name");
  const std::string unit = attribute_of(coordinate, "units");
  if (!unit.empty()) return unit.starts_with("degree");
  return standard == "longitude" || standard == "latitude" || name == "lon" || name == "lat" ||
         name == "longitude" || name == "latitude";
}

/// The coordinate before the largest step, if the steps are not equal; unset if they are.
std::optional<double> unequal_after(const GDALMDArray& coordinate, std::size_t count) {
  std::vector<double> at(count);
  const GUInt64 first = 0;
  if (!coordinate.Read(&first, &count, nullptr, nullptr, GDALExtendedDataType::Create(GDT_Float64),
                       at.data()))
    return std::nullopt;
  const double step = (at.back() - at.front()) / static_cast<double>(count - 1);
  // A missing row moves its neighbours by half a cell or more. Large numbers as floats are rounded.
  const bool is_float = coordinate.GetDataType().GetNumericDataType() == GDT_Float32;
  bool equal = true;
  std::size_t largest = 1;
  for (std::size_t i = 1; i < count; ++i) {
    const double rounding =
        is_float ? std::abs(at[i]) * std::numeric_limits<float>::epsilon() : 0.0;
    equal = equal && std::abs(at[i] - at.front() - static_cast<double>(i) * step) <=
                         0.25 * std::abs(step) + rounding;
    if (std::abs(at[i] - at[i - 1]) > std::abs(at[largest] - at[largest - 1])) largest = i;
  }
  return equal ? std::nullopt : std::optional(at[largest - 1]);
}

}  // namespace

std::string fault_of_netcdf_axes(const std::filesystem::path& file, std::string_view variable) {
  constexpr std::array<const char*, 2> driver = {"netCDF", nullptr};
  const std::unique_ptr<GDALDataset> dataset(
      GDALDataset::Open(std::filesystem::absolute(file).c_str(), GDAL_OF_MULTIDIM_RASTER,
                        driver.data(), nullptr, nullptr));
  const auto root = dataset ? dataset->GetRootGroup() : nullptr;
  const auto array = root ? root->OpenMDArray(std::string(variable)) : nullptr;
  if (!array || array->GetDimensionCount() < 2) return {};
  const auto& dimensions = array->GetDimensions();
  for (const char direction : {'x', 'y'}) {
    const auto& dimension = dimensions[dimensions.size() - (direction == 'x' ? 1 : 2)];
    const auto coordinate = dimension->GetIndexingVariable();
    if (!coordinate || coordinate->GetDimensionCount() != 1) continue;
    const std::string name = coordinate->GetName();
    const char axis = direction_of(*coordinate);
    if (axis != 0 && axis != direction)
      return fmt::format(
          "has '{}' as its {} dimension, expected the order y, x; exchange them (ncpdq -a y,x, or "
          "transpose in xarray)",
          name, direction);
    if (is_in_degrees(*coordinate))
      return fmt::format(
          "has its coordinate '{}' in degrees; project it to metres, with gdalwarp -s_srs EPSG:4326 "
          "-t_srs EPSG:326NN for UTM zone NN",
          name);
    if (const std::string unit = attribute_of(*coordinate, "units"); !is_metre(unit))
      return fmt::format(
          "has its coordinate '{}' in '{}', expected metres; multiply it, and set its units to m",
          name, unit);
    const std::uint64_t count = dimension->GetSize();
    constexpr std::uint64_t most = std::numeric_limits<int>::max();
    if (count < 3 || count > most) continue;
    if (const auto after = unequal_after(*coordinate, static_cast<std::size_t>(count)))
      return fmt::format(
          "has unequal steps in its coordinate '{}', the largest after {}; put it on equal steps "
          "(reindex in xarray leaves holes in gaps)",
          name, *after);
  }
  return {};
}

}  // namespace ensonify::engine
