#include <ensonify/engine/seafloor/bed/survey.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
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

TEST_CASE("Grids that are rotated, in degrees or in feet are refused with the cure") {
  const TemporaryFolder folder;
  Tiff turned = tiff_4x3();
  turned.transform = {500000, 0.8, 0.6, 4000000, 0.6, -0.8};
  CHECK(has(error_of(folder, turned.bytes(), "grid.tif"), "gdalwarp"));
  Tiff mirrored = tiff_4x3();
  mirrored.transform = {500000, -1, 0, 4000000, 0, -1};
  CHECK(has(error_of(folder, mirrored.bytes(), "grid.tif"), "expected positive sizes"));
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
  CHECK(has(error_of(folder, bare), "seems to be in degrees"));
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
