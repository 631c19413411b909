
#include <array>
#include <bit>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "support/catch.h"
#include "support/surveys.h"
#include "support/temporary_folder.h"

using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

/// A coordinate of a netCDF file, with its text attributes.
struct NetCdfAxis {
  std::string name;
  std::vector<double> values;
  std::vector<std::pair<std::string, std::string>> attributes;
};

/// A netCDF file in the classic format, of a variable z over two axes in this order. Its heights
/// are -1, -2, ...
std::string netcdf(const std::array<NetCdfAxis, 2>& axes) {
  const auto word = [](std::size_t value) {
    std::string bytes;
    for (const int shift : {24, 16, 8, 0}) bytes += static_cast<char>(value >> shift & 0xff);
    return bytes;
  };
  const auto text = [&](const std::string& value) {
    std::string bytes = word(value.size()) + value;
    bytes.resize((bytes.size() + 3) / 4 * 4);
    return bytes;
  };
  std::string data;
  const auto number = [&](double value) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    data += word(bits >> 32) + word(bits & 0xffffffff);
  };
  constexpr std::size_t dimension = 10, variable = 11, attribute = 12, character = 2, real = 6;
  std::string header = std::string("CDF\1", 4) + word(0) + word(dimension) + word(2);
  for (const NetCdfAxis& axis : axes) header += text(axis.name) + word(axis.values.size());
  header += word(0) + word(0) + word(variable) + word(3);
  std::vector<std::string> variables;  // up to the place of their values
  std::vector<std::size_t> begins;
  for (const std::size_t i : {0u, 1u}) {
    std::string its = text(axes[i].name) + word(1) + word(i);
    its += axes[i].attributes.empty() ? word(0) : word(attribute);
    its += word(axes[i].attributes.size());
    for (const auto& [name, value] : axes[i].attributes)
      its += text(name) + word(character) + text(value);
    variables.push_back(its + word(real) + word(8 * axes[i].values.size()));
    begins.push_back(data.size());
    for (const double value : axes[i].values) number(value);
  }
  const std::size_t cells = axes[0].values.size() * axes[1].values.size();
  variables.push_back(text("z") + word(2) + word(0) + word(1) + word(0) + word(0) + word(real) +
                      word(8 * cells));
  begins.push_back(data.size());
  for (std::size_t i = 1; i <= cells; ++i) number(-static_cast<double>(i));
  std::size_t header_bytes = header.size();
  for (const std::string& its : variables) header_bytes += its.size() + 4;
  for (std::size_t i = 0; i < 3; ++i) header += variables[i] + word(header_bytes + begins[i]);
  return header + data;
}

}  // namespace

TEST_CASE("A netCDF grid has its axes in order, in metres and with equal steps, or is refused") {
  const TemporaryFolder folder;
  const std::pair<std::string, std::string> east{"standard_name", "projection_x_coordinate"},
      north{"standard_name", "projection_y_coordinate"};
  const NetCdfAxis x{"x", {500000, 500002, 500004, 500006}, {{"units", "m"}, east}};
  const NetCdfAxis y{"y", {4000000, 4000001, 4000002}, {{"units", "Metre"}, north}};
  const Heightfield field = survey_of(folder, netcdf({y, x}), "grid.nc");
  CHECK(field.columns == 4);
  CHECK(field.cell_east_m == 2.0);
  CHECK(field.at(3, 0) == -4.0);
  CHECK(field.at(0, 1) == -5.0);
  CHECK(field.world_origin.x() == 500003.0);
  const auto fault = [&](const NetCdfAxis& first, const NetCdfAxis& second) {
    return survey_error(folder, netcdf({first, second}), "grid.nc");
  };
  CHECK(has(fault(x, y), "has 'y' as its x dimension, expected the order y, x"));
  NetCdfAxis named = x, other = y;  // by its standard name, whatever it is called
  named.name = "a";
  other.name = "b";
  CHECK(fault(other, named).empty());
  CHECK(has(fault(named, other), "expected the order y, x"));
  NetCdfAxis gap = x;
  gap.values = {500000, 500002, 500006, 500008};
  CHECK(has(fault(y, gap), "unequal steps in its coordinate 'x', the largest after 500002"));
  NetCdfAxis kilometres = x;
  kilometres.values = {500, 501, 502, 503};
  kilometres.attributes = {{"units", "km"}, east};
  CHECK(has(fault(y, kilometres), "has its coordinate 'x' in 'km', expected metres"));
  const NetCdfAxis lon{"lon", {-69.0, -68.5, -68.0, -67.5}, {}}, lat{"lat", {42.0, 42.5, 43.0}, {}};
  CHECK(has(fault(lat, lon), "has its coordinate 'lon' in degrees"));
}
