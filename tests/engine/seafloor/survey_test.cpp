#include <ensonify/engine/seafloor/bed/survey.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <ensonify/refine/triangle_mesh.h>

#include "support/catch.h"
#include "support/data.h"
#include "support/grids.h"
#include "support/temporary_folder.h"

using namespace ensonify::engine;
using namespace ensonify::tests;
using ensonify::refine::MeshError;

namespace {

// Rows in the order of a text grid: the northern one first.
std::string text_grid(const std::string& rows, const std::string& size = "ncols 4\nnrows 3\n",
                      const std::string& cell = "cellsize 0.5\n") {
  return size + "xllcorner 500000\nyllcorner 4000000\n" + cell + "NODATA_value -9999\n" + rows;
}
const std::string rows_4x3 = "-1 -2 -3 -4\n-5 -6 -9999 -8\n-9 -10 -11 -12.5\n";

Tiff tiff_4x3() {
  Tiff tiff;
  tiff.columns = 4;
  tiff.rows = 3;
  tiff.heights = {-1, -2, -3, -4, -5, -6, -7, -8, -9, -10, -11, -12.5f};
  return tiff;
}

Heightfield read(const TemporaryFolder& folder, const std::string& bytes,
                 double water_level_m = 0.0, const std::string& name = "grid.asc") {
  write_text(folder / name, bytes);
  return read_survey(folder / name, water_level_m);
}

// The error message, which must name the file.
std::string error_of(const TemporaryFolder& folder, const std::string& bytes,
                     const std::string& name = "grid.asc") {
  try {
    read(folder, bytes, 0.0, name);
  } catch (const MeshError& error) {
    std::string what = error.what();
    CHECK(what.starts_with((folder / name).string() + ": "));
    return what;
  }
  return {};
}

bool has(const std::string& text, const std::string& part) {
  UNSCOPED_INFO(text);
  return text.find(part) != std::string::npos;
}

double valid_share(const Heightfield& field) {
  double valid = 0.0;
  for (const double z : field.z_m) valid += !std::isnan(z);
  return valid / static_cast<double>(field.z_m.size());
}

struct Range {
  double low, high;
};
Range heights(const Heightfield& field) {
  Range range{1e9, -1e9};
  for (const double z : field.z_m)
    if (!std::isnan(z)) range = {std::min(range.low, z), std::max(range.high, z)};
  return range;
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

TEST_CASE("A text grid is read with north up, its holes, its place and the water level") {
  const TemporaryFolder folder;
  for (const std::string line_end : {"\n", "\r\n"}) {
    std::string text = text_grid(rows_4x3);
    for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += line_end.size())
      text.replace(at, 1, line_end);
    const Heightfield field = read(folder, text, 2.0);
    REQUIRE(field.columns == 4);
    REQUIRE(field.rows == 3);
    CHECK(field.cell_east_m == 0.5);
    CHECK(field.cell_north_m == 0.5);
    CHECK(field.at(0, 0) == -11.0);  // south-west: the last row's first, less the water level
    CHECK(field.at(3, 0) == -14.5);  // a fraction after a first number that has none
    CHECK(field.at(0, 2) == -3.0);   // north-west
    CHECK(field.at(3, 2) == -6.0);   // north-east
    CHECK(std::isnan(field.at(2, 1)));
    CHECK(field.world_origin == Eigen::Vector3d(500001.0, 4000000.75, 2.0));
  }
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
}

TEST_CASE("A text grid that begins with integers keeps its fractions, and NaN is a hole") {
  const TemporaryFolder folder;
  std::string rows;
  for (int row = 0; row < 300; ++row) {
    for (int column = 0; column < 100; ++column) rows += row < 299 ? "-9999 " : "-3.25 ";
    rows += '\n';
  }
  rows += "-3.5 nan";
  for (int column = 2; column < 100; ++column) rows += " -4.75";
  const Heightfield field = read(folder, text_grid(rows, "ncols 100\nnrows 301\n", "cellsize 1\n"));
  CHECK(field.at(0, 0) == -3.5);
  CHECK(std::isnan(field.at(1, 0)));
  CHECK(field.at(2, 0) == -4.75);
  CHECK(field.at(7, 1) == -3.25);
}

TEST_CASE("A GeoTIFF is read with north up, in whichever direction its rows run") {
  const TemporaryFolder folder;
  Tiff north_up = tiff_4x3();
  north_up.transform = {356445.531, 2.0, 0, 4679921.45, 0, -3.0};
  Tiff south_up = north_up;
  south_up.transform = {356445.531, 2.0, 0, 4679921.45 - 9.0, 0, 3.0};
  for (std::size_t row = 0; row < 3; ++row)
    std::copy_n(north_up.heights.begin() + static_cast<std::ptrdiff_t>(4 * row), 4,
                south_up.heights.begin() + static_cast<std::ptrdiff_t>(4 * (2 - row)));
  for (const Tiff& tiff : {north_up, south_up}) {
    const Heightfield field = read(folder, tiff.bytes(), 0.5, "grid.tif");
    CHECK(field.cell_east_m == 2.0);
    CHECK(field.cell_north_m == 3.0);
    CHECK(field.at(0, 2) == -1.5);
    CHECK(field.at(3, 2) == -4.5);
    CHECK(field.at(0, 0) == -9.5);
    CHECK(field.at(3, 0) == -13.0);
    CHECK(field.world_origin.x() == Approx(356449.531).epsilon(1e-15));
    CHECK(field.world_origin.y() == Approx(4679916.95).epsilon(1e-15));
    CHECK(field.world_origin.z() == 0.5);
  }
}

TEST_CASE("NODATA printed with few digits and non-finite heights are holes") {
  const TemporaryFolder folder;
  Tiff tiff = tiff_4x3();
  tiff.nodata = "-3.402823e+38";
  tiff.heights[0] = -std::numeric_limits<float>::max();
  tiff.heights[3] = std::numeric_limits<float>::quiet_NaN();
  tiff.heights[11] = -std::numeric_limits<float>::infinity();
  const Heightfield field = read(folder, tiff.bytes(), 0.0, "grid.tif");
  CHECK(std::isnan(field.at(0, 2)));
  CHECK(std::isnan(field.at(3, 2)));
  CHECK(std::isnan(field.at(3, 0)));
  CHECK(valid_share(field) == Approx(9.0 / 12.0));
}

TEST_CASE("Text grids that are truncated, contradict their header or hold no numbers are refused") {
  const TemporaryFolder folder;
  const std::string whole = text_grid(rows_4x3);
  CHECK(has(error_of(folder, ""), "empty"));
  CHECK(has(error_of(folder, text_grid("-1 -2 -3 -4\n-5 -6\n")), "6 heights"));
  CHECK(has(error_of(folder, text_grid(rows_4x3 + "-1 -2 -3 -4\n")), "16 heights"));
  CHECK(has(error_of(folder, text_grid("-1 -2 -3 -4\n-5 -6 x7 -8\n-9 -10 -11 -12\n")),
            "line 8: 'x7' is not a number"));
  CHECK(has(error_of(folder, text_grid(rows_4x3, "ncols 40000\nnrows 30000\n")), "promises"));
  CHECK(has(error_of(folder, text_grid(rows_4x3, "ncols 2000000000\nnrows 2000000000\n")), ": "));
  CHECK(has(error_of(folder, text_grid(rows_4x3, "ncols 5\nnrows 3\n")), "12 heights"));
  CHECK(has(error_of(folder, text_grid(rows_4x3, "ncols -4\nnrows 3\n")), ": "));
  CHECK(has(error_of(folder, text_grid("-1 -2 -3 -4\n", "ncols 4\nnrows 1\n")), "at least 2 x 2"));
  CHECK(has(error_of(folder, text_grid(rows_4x3, "ncols 4\nnrows 3\n", "cellsize 0\n")), ": "));
  CHECK(has(error_of(folder, text_grid(rows_4x3, "ncols 4\nnrows 3\n", "cellsize -1\n")), ": "));
  CHECK(has(error_of(folder, text_grid(rows_4x3, "ncols 4\nnrows 3\n", "cellsize nan\n")), ": "));
  CHECK(has(error_of(folder, text_grid("-1 -2 -3 -4\n-5 -6 99999 -8\n-9 -10 -11 -12\n")), "99999"));
  CHECK(has(error_of(folder, text_grid("-9999 -2 -9999 -4\n-5 -9999 -7 -9999\n-9999 -1 -9999 2\n")),
            "all four corners"));
  CHECK(has(error_of(folder, "hello, I am no grid"), "cannot be read"));
  CHECK_THROWS_AS(read_survey(folder / "absent.asc", 0.0), MeshError);
  CHECK_THROWS_AS(read_survey(folder.path(), 0.0), MeshError);
  CHECK_THROWS_AS(read(folder, whole, std::numeric_limits<double>::quiet_NaN()), MeshError);
  // Any truncation is noticed, except within the last digits.
  for (std::size_t length = 0; length + 5 < whole.size(); ++length) {
    INFO("cut to " << length << " bytes");
    CHECK_THROWS_AS(read(folder, whole.substr(0, length)), MeshError);
  }
}

TEST_CASE("GeoTIFFs that are truncated, have a wrong header or lack blocks are refused") {
  const TemporaryFolder folder;
  const std::string whole = tiff_4x3().bytes();
  CHECK_NOTHROW(read(folder, whole, 0.0, "grid.tif"));
  for (std::size_t length = (whole.size() - 1) % 3; length < whole.size(); length += 3) {
    INFO("cut to " << length << " of " << whole.size() << " bytes");
    CHECK_THROWS_AS(read(folder, whole.substr(0, length), 0.0, "grid.tif"), MeshError);
  }
  Tiff lying = tiff_4x3();
  lying.columns = 200000;
  lying.rows = 200000;
  CHECK(has(error_of(folder, lying.bytes(), "grid.tif"), "promises"));
  lying.columns = 40;
  lying.rows = 30;
  CHECK(has(error_of(folder, lying.bytes(), "grid.tif"), "truncated or damaged"));
  Tiff sparse = tiff_4x3();
  sparse.sparse = true;
  CHECK(has(error_of(folder, sparse.bytes(), "grid.tif"), "blocks without data"));
}

TEST_CASE("Heights of 9999 m mark missing ones where no NODATA value is declared") {
  const TemporaryFolder folder;
  std::string bare = text_grid(rows_4x3);
  const std::string nodata = "NODATA_value -9999\n";
  bare.erase(bare.find(nodata), nodata.size());
  CHECK(std::isnan(read(folder, bare).at(2, 1)));  // ESRI's default
  Tiff tiff = tiff_4x3();
  for (const float missing : {-9999.0f, 9999.0f}) {
    tiff.heights[6] = missing;
    CHECK(has(error_of(folder, tiff.bytes(), "grid.tif"),
              "row 2, column 3: a height of " + std::to_string(static_cast<int>(missing)) +
                  " m; if it marks missing data, declare it with gdal_edit.py -a_nodata " +
                  std::to_string(static_cast<int>(missing))));
  }
  tiff.nodata = "-32768";
  CHECK(read(folder, tiff.bytes(), 0.0, "grid.tif").at(2, 1) == 9999.0);
  CHECK(has(error_of(folder, text_grid("-1 -2 -3 -4\n-5 -6 99999 -8\n-9 -10 -11 -12\n")),
            "with a line NODATA_value 99999"));
}

TEST_CASE("Grids that are rotated, in degrees or in feet are refused with the cure") {
  const TemporaryFolder folder;
  Tiff turned = tiff_4x3();
  turned.transform = {500000, 0.8, 0.6, 4000000, 0.6, -0.8};
  CHECK(has(error_of(folder, turned.bytes(), "grid.tif"), "gdalwarp"));
  Tiff mirrored = tiff_4x3();
  mirrored.transform = {500000, -1, 0, 4000000, 0, -1};
  CHECK(has(error_of(folder, mirrored.bytes(), "grid.tif"),
            "expected positive sizes; make it north-up with"));
  Tiff degrees = tiff_4x3();
  degrees.geographic = true;
  degrees.epsg = 4326;
  degrees.transform = {-70.7, 1e-4, 0, 42.2, 0, -1e-4};
  CHECK(has(error_of(folder, degrees.bytes(), "grid.tif"), "degrees"));
  CHECK(has(error_of(folder, degrees.bytes(), "grid.tif"), "gdalwarp -t_srs"));
  Tiff feet = tiff_4x3();
  feet.epsg = 2249;  // Massachusetts, US survey feet
  CHECK(has(error_of(folder, feet.bytes(), "grid.tif"), "0.3048"));
  // A text grid names no unit.
  const std::string bare =
      "ncols 2\nnrows 2\nxllcorner -70.5\nyllcorner 42.1\ncellsize 0.0008333\n-1 -2\n-3 -4\n";
  Tiff mercator = tiff_4x3();
  mercator.epsg = 3857;
  mercator.transform = {-7870000, 1, 0, 5300000, 0, -1};  // 43 degrees north
  CHECK(has(error_of(folder, mercator.bytes(), "grid.tif"), "map metres that are 0.73 m on Earth"));
  CHECK(has(error_of(folder, bare), "seems to be in degrees"));
  const auto with_cell = [&](const std::string& cell) {
    std::string text = bare;
    text.replace(text.find("0.0008333"), 9, cell);
    return error_of(folder, text);
  };
  CHECK(has(with_cell("0.0166667"), "seems to be in degrees"));  // a minute
  for (const char* const cell : {"0.01", "0.02", "0.05", "0.025"}) CHECK(with_cell(cell).empty());
}

TEST_CASE("A file next to a survey does not change it") {
  const TemporaryFolder folder;
  write_text(folder / "grid.asc", text_grid(rows_4x3));
  write_text(folder / "grid.asc.aux.xml",
             "<PAMDataset><GeoTransform>0,7,0,0,0,-7</GeoTransform><PAMRasterBand band=\"1\">"
             "<NoDataValue>-6</NoDataValue></PAMRasterBand></PAMDataset>");
  const Heightfield field = read_survey(folder / "grid.asc", 0.0);
  CHECK(field.cell_east_m == 0.5);
  CHECK(field.at(1, 1) == -6.0);
}

TEST_CASE("Real surveys have their known size, place, heights and holes") {
  struct Known {
    const char* name;
    int columns, rows;
    double cell_m, low_m, high_m, valid_share, tolerance;
    Eigen::Vector2d middle;
  };
  const Known all[] = {
      {"bathymetry/portsmouth_tiny_0.5m.bag", 117, 87, 0.5, -13.77, -12.07, 0.969, 0.005, {0, 0}},
      {"bathymetry/massbay_5m.tif",
       1125,
       661,
       5.0013,
       -29.91,
       -6.45,
       0.998,
       0.005,
       {359258.776, 4678268.513}},
      {"bathymetry/colorado_river_0.25m.asc",
       158,
       147,
       0.25,
       372.46,
       375.79,
       0.5,
       0.1,
       {82126.75, 530182.375}}};
  for (const Known& known : all) {
    const auto file = data_file(known.name);
    if (!file) {
      WARN("skipped: " << known.name << " is missing (ENSONIFY_DATA)");
      continue;
    }
    const Heightfield field = read_survey(*file, 0.0);
    INFO(known.name);
    CHECK(field.columns == known.columns);
    CHECK(field.rows == known.rows);
    CHECK(field.cell_east_m == Approx(known.cell_m).epsilon(1e-4));
    CHECK(field.cell_north_m == Approx(known.cell_m).epsilon(1e-4));
    const Range range = heights(field);
    CHECK(range.low == Approx(known.low_m).margin(known.tolerance * 10));
    CHECK(range.high == Approx(known.high_m).margin(known.tolerance * 10));
    CHECK(valid_share(field) == Approx(known.valid_share).margin(known.tolerance));
    if (known.middle.x() != 0.0) CHECK((field.world_origin.head<2>() - known.middle).norm() < 1e-2);
  }
}

TEST_CASE("Scatter needs a band with the uncertainty") {
  const TemporaryFolder folder;
  write_text(folder / "grid.asc", text_grid(rows_4x3));
  CHECK_THROWS_WITH(read_survey(folder / "grid.asc", 0.0, {1.0, 1}),
                    Catch::Contains("seafloor.uncertainty_scatter"));
}

TEST_CASE("A truncated BAG is refused") {
  const auto file = data_file("bathymetry/portsmouth_tiny_0.5m.bag");
  if (!file) {
    WARN("skipped: portsmouth_tiny_0.5m.bag is missing (ENSONIFY_DATA)");
    return;
  }
  const TemporaryFolder folder;
  const std::string whole = bytes_of(*file);
  REQUIRE_NOTHROW(read(folder, whole, 0.0, "grid.bag"));
  for (int part = 0; part < 20; ++part)
    CHECK_THROWS_AS(
        read(folder, whole.substr(0, whole.size() * static_cast<std::size_t>(part) / 20), 0.0,
             "grid.bag"),
        MeshError);
}

namespace {

/// A VRT of two halves of 2 x 3 points, or with another `source` in place of the second.
std::string mosaic_text(const std::string& source) {
  const auto half = [](const std::string& element, int column) {
    return "<SimpleSource>" + element +
           "<SourceBand>1</SourceBand><SrcRect xOff=\"0\" yOff=\"0\" xSize=\"2\" ySize=\"3\"/>"
           "<DstRect xOff=\"" +
           std::to_string(column) + "\" yOff=\"0\" xSize=\"2\" ySize=\"3\"/></SimpleSource>";
  };
  return "<VRTDataset rasterXSize=\"4\" rasterYSize=\"3\"><SRS>EPSG:32619</SRS>"
         "<GeoTransform>500000, 1, 0, 4000000, 0, -1</GeoTransform>"
         "<VRTRasterBand dataType=\"Float32\" band=\"1\"><NoDataValue>-9999</NoDataValue>" +
         half("<SourceFilename relativeToVRT=\"1\">west.tif</SourceFilename>", 0) +
         half(source, 2) + "</VRTRasterBand></VRTDataset>";
}
const std::string east_half = "<SourceFilename relativeToVRT=\"1\">east.tif</SourceFilename>";

void write_halves(const TemporaryFolder& folder) {
  const Tiff whole = tiff_4x3();
  for (const int half : {0, 1}) {
    Tiff tiff;
    tiff.columns = 2;
    tiff.rows = 3;
    tiff.transform = {500000.0 + 2 * half, 1, 0, 4000000, 0, -1};
    for (std::size_t row = 0; row < 3; ++row)
      for (std::size_t column = 0; column < 2; ++column)
        tiff.heights.push_back(
            whole.heights[row * 4 + static_cast<std::size_t>(2 * half) + column]);
    write_text(folder / (half == 0 ? "west.tif" : "east.tif"), tiff.bytes());
  }
}

}  // namespace

TEST_CASE("A VRT mosaic of local files reads as the whole grid") {
  const TemporaryFolder folder;
  write_halves(folder);
  const Heightfield whole = read(folder, tiff_4x3().bytes(), 0.5, "whole.tif");
  const Heightfield mosaic = read(folder, mosaic_text(east_half), 0.5, "bed.vrt");
  CHECK(mosaic.z_m == whole.z_m);
  CHECK(mosaic.world_origin == whole.world_origin);
  CHECK(mosaic.utm_zone == whole.utm_zone);
  CHECK(files_of_survey(folder / "bed.vrt") ==
        std::vector<std::filesystem::path>{folder / "bed.vrt", folder / "west.tif",
                                           folder / "east.tif"});
}

TEST_CASE("Of several bands the one with the name of heights is read, or else the first") {
  const TemporaryFolder folder;
  const Tiff heights = tiff_4x3();
  Tiff other = heights;
  for (float& z : other.heights) z = -3.0f;
  write_text(folder / "heights.tif", heights.bytes());
  write_text(folder / "other.tif", other.bytes());
  const Heightfield of_heights = read_survey(folder / "heights.tif", 0.0);
  const Heightfield of_other = read_survey(folder / "other.tif", 0.0);
  REQUIRE(of_heights.z_m != of_other.z_m);
  const auto with_bands = [&](const std::string& first, const std::string& second) {
    const auto band = [](int number, const std::string& name, const std::string& file) {
      return "<VRTRasterBand dataType=\"Float32\" band=\"" + std::to_string(number) +
             "\"><Description>" + name + "</Description><SimpleSource>" +
             "<SourceFilename relativeToVRT=\"1\">" + file + "</SourceFilename>" +
             "<SourceBand>1</SourceBand></SimpleSource></VRTRasterBand>";
    };
    return read(folder,
                "<VRTDataset rasterXSize=\"4\" rasterYSize=\"3\"><SRS>EPSG:32619</SRS>"
                "<GeoTransform>500000, 1, 0, 4000000, 0, -1</GeoTransform>" +
                    band(1, first, "other.tif") + band(2, second, "heights.tif") + "</VRTDataset>",
                0.0, "bands.vrt")
        .z_m;
  };
  CHECK(with_bands("density", "Elevation") == of_heights.z_m);
  CHECK(with_bands("Depth uncertainty", "depth") == of_heights.z_m);
  CHECK(with_bands("elevation", "bathymetry") == of_other.z_m);
  CHECK(with_bands("", "") == of_other.z_m);
}

namespace {

/// A VRT of heights.tif, with more elements in its band or after it.
std::string vrt_of_heights(const std::string& in_band, const std::string& after = {}) {
  return "<VRTDataset rasterXSize=\"4\" rasterYSize=\"3\"><SRS>EPSG:32619</SRS>"
         "<GeoTransform>500000, 1, 0, 4000000, 0, -1</GeoTransform>"
         "<VRTRasterBand dataType=\"Float32\" band=\"1\">" +
         in_band +
         "<SimpleSource><SourceFilename relativeToVRT=\"1\">heights.tif</SourceFilename>"
         "<SourceBand>1</SourceBand></SimpleSource></VRTRasterBand>" +
         after + "</VRTDataset>";
}

}  // namespace

TEST_CASE("Heights in another unit than metres are refused") {
  const TemporaryFolder folder;
  write_text(folder / "heights.tif", tiff_4x3().bytes());
  const auto error_for = [&](const std::string& unit) {
    return error_of(folder, vrt_of_heights("<UnitType>" + unit + "</UnitType>"), "bed.vrt");
  };
  for (const char* const unit : {"m", "M", "metre", "Meters"}) CHECK(error_for(unit).empty());
  for (const char* const unit : {"cm", "dm", "km", "fathom", "FT", "US survey foot"})
    CHECK(has(error_for(unit), "has heights in '" + std::string(unit) +
                                   "'; convert them to metres with gdal_calc.py"));
}

TEST_CASE("Heights that a mask or an alpha band hides are holes") {
  const TemporaryFolder folder;
  write_text(folder / "heights.tif", tiff_4x3().bytes());
  Tiff mask = tiff_4x3();
  mask.heights.assign(12, 255.0f);
  mask.heights[2] = 0.0f;
  write_text(folder / "mask.tif", mask.bytes());
  const auto band = [](const std::string& attributes, const std::string& colour) {
    return "<VRTRasterBand dataType=\"Byte\"" + attributes + ">" + colour +
           "<SimpleSource><SourceFilename relativeToVRT=\"1\">mask.tif</SourceFilename>"
           "<SourceBand>1</SourceBand></SimpleSource></VRTRasterBand>";
  };
  for (const std::string& hides : {"<MaskBand>" + band("", "") + "</MaskBand>",
                                   band(" band=\"2\"", "<ColorInterp>Alpha</ColorInterp>")}) {
    const Heightfield field = read(folder, vrt_of_heights("", hides), 0.0, "bed.vrt");
    CHECK(valid_share(field) == Approx(11.0 / 12.0));
    CHECK(std::isnan(field.at(2, 2)));
    CHECK(field.at(3, 2) == -4.0);
    std::vector<double> window(2);
    survey_tiles(folder / "bed.vrt", 0.0)(2, 2, 2, 1, window, {});
    CHECK(std::isnan(window[0]));
    CHECK(window[1] == -4.0);
  }
}

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
  const Heightfield field = read(folder, netcdf({y, x}), 0.0, "grid.nc");
  CHECK(field.columns == 4);
  CHECK(field.cell_east_m == 2.0);
  CHECK(field.at(3, 0) == -4.0);
  CHECK(field.at(0, 1) == -5.0);
  CHECK(field.world_origin.x() == 500003.0);
  const auto fault = [&](const NetCdfAxis& first, const NetCdfAxis& second) {
    return error_of(folder, netcdf({first, second}), "grid.nc");
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

TEST_CASE("A VRT mosaic that names other hosts, other mosaics or functions is refused") {
  const TemporaryFolder folder;
  write_halves(folder);
  write_text(folder / "inner.vrt", mosaic_text(east_half));
  write_text(folder / "inner.tif", mosaic_text(east_half));
  const auto named = [](const std::string& file) {
    return "<SourceFilename relativeToVRT=\"0\">" + file + "</SourceFilename>";
  };
  for (const std::string& source :
       {named("/vsicurl/http://localhost/east.tif"), named("http://localhost/east.tif"),
        named("/vsizip/east.zip"), named(""), named("east.tif"),
        named((folder / "inner.vrt").string()), named((folder / "inner.tif").string()),
        named("&lt;VRTDataset&gt;"),
        east_half + "<OpenOptions><OOI key=\"a\">b</OOI></OpenOptions>",
        east_half + "<PixelFunctionType>sum</PixelFunctionType>"}) {
    CAPTURE(source);
    CHECK(has(error_of(folder, mosaic_text(source), "bed.vrt"), "local files"));
  }
  CHECK(has(error_of(folder, "<VRTDataset rasterXSize=\"4\"", "bed.vrt"), "VRT"));
}

TEST_CASE("A VRT mosaic names files only below its own folder") {
  const TemporaryFolder folder;
  write_halves(folder);
  const std::filesystem::path inner = folder / "inner";
  std::filesystem::create_directory(inner);
  std::filesystem::create_symlink(folder / "east.tif", inner / "link.tif");
  std::filesystem::copy_file(folder / "west.tif", inner / "west.tif");
  for (const std::string& source :
       {std::string("<SourceFilename relativeToVRT=\"1\">../east.tif"),
        std::string("<SourceFilename relativeToVRT=\"1\">link.tif"),
        "<SourceFilename relativeToVRT=\"0\">" + (folder / "east.tif").string()}) {
    CAPTURE(source);
    CHECK(has(error_of(folder, mosaic_text(source + "</SourceFilename>"), "inner/bed.vrt"),
              "does not lie in its own folder"));
  }
}

TEST_CASE("A survey's windows have the heights of the whole") {
  const TemporaryFolder folder;
  const Heightfield whole = read(folder, text_grid(rows_4x3), 0.5);
  write_text(folder / "grid.tif", tiff_4x3().bytes());
  const Heightfield of_tiff = read_survey(folder / "grid.tif", 0.5);
  for (const auto& [name, expected] :
       {std::pair{"grid.asc", &whole}, std::pair{"grid.tif", &of_tiff}}) {
    CAPTURE(name);
    const auto heights = survey_tiles(folder / name, 0.5);
    for (int columns = 1; columns <= 4; ++columns)
      for (int rows = 1; rows <= 3; ++rows)
        for (int column = 0; column + columns <= 4; ++column)
          for (int row = 0; row + rows <= 3; ++row) {
            std::vector<double> z_m(static_cast<std::size_t>(columns * rows));
            heights(column, row, columns, rows, z_m, {});
            bool same = true;
            for (int j = 0; j < rows; ++j)
              for (int i = 0; i < columns; ++i) {
                const double z = z_m[static_cast<std::size_t>(j * columns + i)];
                const double wanted = expected->at(column + i, row + j);
                same = same && (z == wanted || (std::isnan(z) && std::isnan(wanted)));
              }
            CHECK(same);
          }
  }
  const SurveySample sample = sample_survey(folder / "grid.tif", 0.5);
  CHECK(sample.lowest_m == -13.0);
  CHECK(sample.highest_m == -1.5);
}

namespace {

/// An .npy file of version 1 with these numbers.
template <class Number>
std::string npy(const std::string& type, const std::string& shape,
                const std::vector<Number>& numbers, const std::string& by_columns = "False") {
  std::string header =
      "{'descr': '" + type + "', 'fortran_order': " + by_columns + ", 'shape': " + shape + ", }";
  header.resize(117, ' ');
  header += '\n';
  return std::string("\x93NUMPY\x01\x00\x76\x00", 10) + header +
         std::string(reinterpret_cast<const char*>(numbers.data()),
                     numbers.size() * sizeof(Number));
}

/// The message for a file with a cell size, which must name the file.
std::string error_with_cell(const TemporaryFolder& folder, const std::string& bytes,
                            const std::string& name, double cell_m) {
  write_text(folder / name, bytes);
  try {
    read_survey({folder / name, cell_m}, 0.0);
  } catch (const MeshError& error) {
    std::string what = error.what();
    CHECK(what.starts_with((folder / name).string() + ": "));
    return what;
  }
  return {};
}

constexpr double hole = std::numeric_limits<double>::quiet_NaN();

}  // namespace

TEST_CASE("an .npy file has the southern row first and the cell size that is given") {
  const TemporaryFolder folder;
  const auto check = [&](const std::string& bytes) {
    write_text(folder / "a.npy", bytes);
    const Heightfield field = read_survey({folder / "a.npy", 0.5}, -1.0);
    REQUIRE(field.columns == 3);
    REQUIRE(field.rows == 2);
    CHECK(field.cell_east_m == 0.5);
    CHECK(field.cell_north_m == 0.5);
    CHECK(field.world_origin == Eigen::Vector3d(0.0, 0.0, -1.0));
    const std::vector<double> z_m{-9, -8, -7, -6, -5, -4};
    for (std::size_t i = 0; i < z_m.size(); ++i) CHECK(field.z_m[i] == z_m[i]);
  };
  check(npy<double>("<f8", "(2, 3)", {-10, -9, -8, -7, -6, -5}));
  check(npy<float>("<f4", "(2, 3)", {-10, -9, -8, -7, -6, -5}));
  check(npy<std::int32_t>("<i4", "(2, 3)", {-10, -9, -8, -7, -6, -5}));
  check(npy<float>("<f4", "(2, 3)", {-10, -7, -9, -6, -8, -5}, "True"));
  std::vector<std::uint16_t> swapped;
  for (const std::int16_t z : {-10, -9, -8, -7, -6, -5})
    swapped.push_back(static_cast<std::uint16_t>(static_cast<std::uint16_t>(z) << 8 |
                                                 static_cast<std::uint16_t>(z) >> 8));
  check(npy<std::uint16_t>(">i2", "(2, 3)", swapped));
}

TEST_CASE("an .npy file may have holes, and is read by windows") {
  const TemporaryFolder folder;
  write_text(folder / "a & b.npy",
             npy<double>("<f8", "(3, 3)", {-1, -2, -3, -4, -5, -6, -7, -8, hole}));
  const SurveyFile file{folder / "a & b.npy", 2.0};
  const Heightfield field = read_survey(file, 0.0);
  CHECK(std::isnan(field.at(2, 2)));
  CHECK(field.at(1, 2) == -8.0);
  std::vector<double> window(2);
  survey_tiles(file, 0.0)(1, 1, 2, 1, window, {});
  CHECK(window == std::vector<double>{-5, -6});
  CHECK(survey_reference(file).empty());
}

TEST_CASE("faults of an .npy file are named, and so is a cell size that is missing or too much") {
  const TemporaryFolder folder;
  const std::vector<double> six{-1, -2, -3, -4, -5, -6};
  const std::string good = npy("<f8", "(2, 3)", six);
  const auto fault = [&](const std::string& bytes, const std::string& part, double cell_m = 1.0) {
    CHECK(has(error_with_cell(folder, bytes, "a.npy", cell_m), part));
  };
  fault(good, "set seafloor.survey_cell_m", 0.0);
  fault(good.substr(0, good.size() - 1), "truncated");
  fault(good + "x", "truncated or damaged");
  fault(good.substr(0, 40), "whole header");
  fault(good.substr(0, 8), "whole header");
  fault(npy("<f8", "(6,)", six), "two dimensions");
  fault(npy("<f8", "(1, 2, 3)", six), "two dimensions");
  fault(npy("<f8", "(9999999999, 9999999999)", six), "truncated");
  fault(npy("<c16", "(2, 3)", six), "float64 or float32");
  fault(npy("|b1", "(2, 3)", six), "float64 or float32");
  fault(npy("<f8", "(1, 6)", six), "at least 2 x 2");
  fault(npy("<f8", "(2, 3)", std::vector<double>{-1, -2, -3, 1e9, -5, -6}), "a height of");
  CHECK(has(error_with_cell(folder, text_grid(rows_4x3), "grid.asc", 1.0),
            "leave seafloor.survey_cell_m out"));
}

TEST_CASE("soundings that lie on a plane make that plane, with holes where there are none") {
  const TemporaryFolder folder;
  std::string text = "\xEF\xBB\xBF# a survey\r\nx,y,z\r\n";
  const auto height = [](double x, double y) {
    return -20.0 + 0.1 * (x - 500000.0) - 0.2 * (y - 6200000.0);
  };
  for (int i = 0; i < 4000; ++i) {
    // Not on a lattice; nothing from 12 to 20 m east.
    const double x = 500000.0 + std::fmod(0.754877666 * i, 1.0) * 24.0;
    const double y = 6200000.0 + std::fmod(0.569840291 * i, 1.0) * 10.0;
    if (x > 500012.0 && x < 500020.0) continue;
    std::array<char, 100> line{};
    std::snprintf(line.data(), line.size(), "%.4f, %.4f, %.5f, 7\r\n", x, y, height(x, y));
    text += line.data();
  }
  write_text(folder / "a.xyz", text);
  const Heightfield field = read_survey({folder / "a.xyz", 0.5}, 0.0);
  CHECK(field.columns == 48);
  CHECK(field.rows == 20);
  for (int row = 0; row < field.rows; ++row)
    for (int column = 0; column < field.columns; ++column) {
      const double x = field.x_m(column) + field.world_origin.x(),
                   y = field.y_m(row) + field.world_origin.y();
      CAPTURE(x - 500000.0, y - 6200000.0);
      const double z = field.at(column, row);
      if (x > 500013.1 && x < 500018.9)
        CHECK(std::isnan(z));
      else if (row > 0 && row + 1 < field.rows && column > 0 && column + 1 < field.columns &&
               (x < 500012.9 || x > 500019.1))
        CHECK(z == Approx(height(x, y)).epsilon(0).margin(1e-4));
      else
        CHECK((std::isnan(z) || std::abs(z - height(x, y)) < 0.3));  // no triangle outside
    }
  // The same by windows, and the header without heights.
  std::vector<double> window(1);
  survey_tiles({folder / "a.xyz", 0.5}, 0.0)(5, 6, 1, 1, window, {});
  CHECK(window[0] == field.at(5, 6));
  CHECK(read_survey_header({folder / "a.xyz", 0.5}).columns == 48);
}

TEST_CASE("faults of soundings are named with their line") {
  const TemporaryFolder folder;
  const std::string good = "0 0 -5\n3 0 -6\n0 3 -7\n3 3 -8\n";
  const auto fault = [&](const std::string& text, const std::string& part, double cell_m = 1.0) {
    CHECK(has(error_with_cell(folder, text, "a.txt", cell_m), part));
  };
  CHECK(error_with_cell(folder, good, "a.txt", 1.0).empty());
  fault(good, "set seafloor.survey_cell_m", 0.0);
  fault(good + "4 4\n", "line 5: '4 4' does not begin with three numbers");
  fault(good + "4 4 nan\n", "line 5");
  fault(good + "4 4 -5m\n", "line 5");
  fault("east north up\n" + good + "east north up\n", "line 6");
  fault(good + "1e6 1e6 -5\n", "soundings that lie far off");
  fault(good, "fewer than 2 x 2 cells", 10.0);
  fault("0 0 -5\n1 1 -6\n2 2 -7\n3 3 -8\n", "on one line");
  fault(good + "2 2 99999\n", "line 5: a height of 99999 m");
}

TEST_CASE("the first line of soundings names their columns, in any order") {
  const TemporaryFolder folder;
  const auto read_text = [&](const std::string& text) {
    write_text(folder / "a.txt", text);
    return read_survey({folder / "a.txt", 1.0}, 0.0);
  };
  const Heightfield expected = read_text("0 0 -5\n3 0 -6\n0 5 -7\n3 5 -8\n");
  for (const std::string text :
       {"northing,easting,depth\n0,0,-5\n0,3,-6\n5,0,-7\n5,3,-8\n",
        "id;X (m);Y (m);Z (m)\nA 1;0;0;-5\n;3;0;-6\nc;0;5;-7\nd;3;5;-8\n",
        "\"Depth_m\"\tEast\tNorth\n-5\t0\t0\n-6\t3\t0\n-7\t0\t5\n-8\t3\t5\n",
        "a b c\n0 0 -5\n3 0 -6\n0 5 -7\n3 5 -8\n"}) {
    CAPTURE(text);
    const Heightfield field = read_text(text);
    CHECK(field.columns == expected.columns);
    CHECK(field.rows == expected.rows);
    CHECK(field.at(1, 1) == Approx(expected.at(1, 1)));
  }
  const auto fault = [&](const std::string& text, const std::string& part) {
    CHECK(has(error_with_cell(folder, text, "a.txt", 1.0), part));
  };
  for (const char* const header :
       {"id,east,north", "a,b,c,d", "lon,lat,depth", "x,y,depth_ft,z_ft"})
    fault(header + std::string("\n0,0,-5,1\n3,0,-6,1\n0,5,-7,1\n"), "line 1: '");
  fault("x;y;z\n0,5;0;-5\n", "line 2: has commas inside its fields");
  fault("0,5 1,5 -5,5\n3 0 -6\n", "line 1: has commas inside its fields");
  fault("x,y,z\n0,0,-5\n3,,-6\n", "line 3: '3,,-6' has no numbers x y z where the first line");
  fault("0 0 -9999\n3 0 -6\n0 3 -7\n", "line 1: a height of -9999 m");
}

TEST_CASE("real soundings on a grid are those that their surveyors' grid has") {
  const auto soundings = data_file("bathymetry/colorado_river_mbes_100k.xyz"),
             grid = data_file("bathymetry/colorado_river_0.25m.asc");
  if (!soundings || !grid) {
    WARN("skipped: the river's survey is not there");
    return;
  }
  const Heightfield ours = read_survey({*soundings, 0.25}, 370.0),
                    theirs = read_survey(*grid, 370.0);
  std::vector<double> apart_m;
  for (int row = 0; row < ours.rows; ++row)
    for (int column = 0; column < ours.columns; ++column) {
      const auto at = [&](double place, double origin, double step, int count) {
        return std::clamp(static_cast<int>(std::lround((place - origin) / step)), 0, count - 1);
      };
      const int c = at(ours.x_m(column) + ours.world_origin.x(),
                       theirs.x_m(0) + theirs.world_origin.x(), 0.25, theirs.columns),
                r = at(ours.y_m(row) + ours.world_origin.y(),
                       theirs.y_m(0) + theirs.world_origin.y(), 0.25, theirs.rows);
      const double difference = ours.at(column, row) - theirs.at(c, r);
      if (!std::isnan(difference)) apart_m.push_back(std::abs(difference));
    }
  REQUIRE(apart_m.size() > 5000);
  std::ranges::sort(apart_m);
  INFO("median " << apart_m[apart_m.size() / 2] << " 95 % " << apart_m[apart_m.size() * 95 / 100]);
  CHECK(apart_m[apart_m.size() / 2] < 0.02);
  CHECK(apart_m[apart_m.size() * 95 / 100] < 0.1);
  CHECK(std::abs(valid_share(ours) * ours.columns * ours.rows /
                     (valid_share(theirs) * theirs.columns * theirs.rows) -
                 1.0) < 0.15);
}

TEST_CASE("damaged .npy files and soundings are read or refused, and nothing else happens") {
  const TemporaryFolder folder;
  std::mt19937 random(11);
  const std::vector<double> heights{-1, -2, -3, -4, -5, -6, -7, -8, -9, -10, -11, -12};
  for (const auto& [name, good] :
       {std::pair{"a.npy", npy("<f8", "(3, 4)", heights)},
        std::pair{"a.xyz", std::string("0 0 -5\n3 0 -6\n0 3 -7\n3 3 -8\n1.5 1 -7.5\n")}}) {
    int refused = 0;
    for (int round = 0; round < 200; ++round) {
      std::string damaged = good;
      for (unsigned i = 0; i <= random() % 3; ++i)
        damaged[random() % damaged.size()] = static_cast<char>(random());
      if (round % 2 == 0) damaged.resize(random() % damaged.size());
      refused += !error_with_cell(folder, damaged, name, 1.0).empty();
    }
    CHECK(refused > 40);
  }
}
