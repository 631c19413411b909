#include <ensonify/engine/seafloor/bed/survey.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gdal.h>

#include <ensonify/refine/triangle_mesh.h>

#include "support/catch.h"
#include "support/data.h"
#include "support/files.h"
#include "support/little_memory.h"
#include "support/surveys.h"
#include "support/temporary_folder.h"

using namespace ensonify::engine;
using namespace ensonify::tests;
using ensonify::refine::MeshError;

namespace {

struct HeightRange {
  double low, high;
};
HeightRange heights(const Heightfield& field) {
  HeightRange range{1e9, -1e9};
  for (const double z : field.z_m)
    if (!std::isnan(z)) range = {std::min(range.low, z), std::max(range.high, z)};
  return range;
}

}  // namespace

TEST_CASE("A text grid is read with north up, its holes, its place and the water level") {
  const TemporaryFolder folder;
  for (const std::string line_end : {"\n", "\r\n"}) {
    std::string text = text_grid(rows_4x3);
    for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += line_end.size())
      text.replace(at, 1, line_end);
    const Heightfield field = survey_of(folder, text, "grid.asc", 2.0);
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
  const Heightfield field =
      survey_of(folder, text_grid(rows, "ncols 100\nnrows 301\n", "cellsize 1\n"), "grid.asc");
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
    const Heightfield field = survey_of(folder, tiff.bytes(), "grid.tif", 0.5);
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

TEST_CASE("A byte-order mark before a text grid changes neither its heights nor its reference") {
  const TemporaryFolder folder;
  write_text(folder / "grid.prj", "Projection UTM\nDatum WGS84\nZone 32\nUnits METERS\n");
  const std::string text = text_grid("-1 -2 -3.5 -4\n-5 -9999 -7 -8\n-9 -10 -11 -12\n");
  const Heightfield plain = survey_of(folder, text, "grid.asc");
  const Heightfield marked = survey_of(folder, "\xef\xbb\xbf" + text, "grid.asc");
  CHECK(marked.at(2, 2) == -3.5);
  CHECK(std::isnan(marked.at(1, 1)));
  CHECK(marked.world_origin == plain.world_origin);
  CHECK(marked.utm_zone == 32);
  CHECK(marked.reference == plain.reference);
}

TEST_CASE("NODATA printed with few digits and non-finite heights are holes") {
  const TemporaryFolder folder;
  Tiff tiff = tiff_4x3();
  tiff.nodata = "-3.402823e+38";
  tiff.heights[0] = -std::numeric_limits<float>::max();
  tiff.heights[3] = std::numeric_limits<float>::quiet_NaN();
  tiff.heights[11] = -std::numeric_limits<float>::infinity();
  const Heightfield field = survey_of(folder, tiff.bytes(), "grid.tif");
  CHECK(std::isnan(field.at(0, 2)));
  CHECK(std::isnan(field.at(3, 2)));
  CHECK(std::isnan(field.at(3, 0)));
  CHECK(valid_share(field) == Approx(9.0 / 12.0));
}

TEST_CASE("Text grids that are truncated, contradict their header or hold no numbers are refused") {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& text) {
    return survey_error(folder, text, "grid.asc");
  };
  const std::string whole = text_grid(rows_4x3);
  CHECK(has(error(""), "empty"));
  CHECK(has(error(text_grid("-1 -2 -3 -4\n-5 -6\n")), "6 heights"));
  CHECK(has(error(text_grid(rows_4x3 + "-1 -2 -3 -4\n")), "16 heights"));
  CHECK(has(error(text_grid("-1 -2 -3 -4\n-5 -6 x7 -8\n-9 -10 -11 -12\n")),
            "line 8: 'x7' is not a number"));
  CHECK(has(error(text_grid("nan -2 -3 -4\n-5 -6 -7 -8\n-9 -10 -11 -12\n")),
            "line 7: a first height of 'nan' cannot be read"));
  CHECK(has(error(text_grid(rows_4x3, "ncols 40000\nnrows 30000\n")), "promises"));
  CHECK(has(error(text_grid(rows_4x3, "ncols 2000000000\nnrows 2000000000\n")), ": "));
  CHECK(has(error(text_grid(rows_4x3, "ncols 5\nnrows 3\n")), "12 heights"));
  CHECK(has(error(text_grid(rows_4x3, "ncols -4\nnrows 3\n")), ": "));
  CHECK(has(error(text_grid("-1 -2 -3 -4\n", "ncols 4\nnrows 1\n")), "at least 2 x 2"));
  CHECK(has(error(text_grid(rows_4x3, "ncols 4\nnrows 3\n", "cellsize 0\n")), ": "));
  CHECK(has(error(text_grid(rows_4x3, "ncols 4\nnrows 3\n", "cellsize -1\n")), ": "));
  CHECK(has(error(text_grid(rows_4x3, "ncols 4\nnrows 3\n", "cellsize nan\n")), ": "));
  CHECK(has(error(text_grid("-1 -2 -3 -4\n-5 -6 99999 -8\n-9 -10 -11 -12\n")), "99999"));
  CHECK(has(error(text_grid("-9999 -2 -9999 -4\n-5 -9999 -7 -9999\n-9999 -1 -9999 2\n")),
            "all four corners"));
  CHECK(has(error("hello, I am no grid"), "cannot be read"));
  CHECK(has(error(text_grid("-1,5 -2 -3 -4\n-5 -6 -7 -8\n-9 -10 -11 -12\n")),
            "line 7: '-1,5' is not a number, expected a decimal point"));
  CHECK_THROWS_AS(read_survey(folder / "absent.asc", 0.0), MeshError);
  CHECK_THROWS_AS(read_survey(folder.path(), 0.0), MeshError);
  CHECK_THROWS_AS(survey_of(folder, whole, "grid.asc", std::numeric_limits<double>::quiet_NaN()),
                  MeshError);
  // Any truncation is noticed, except within the last digits.
  for (std::size_t length = 0; length + 5 < whole.size(); ++length) {
    INFO("cut to " << length << " bytes");
    CHECK_THROWS_AS(survey_of(folder, whole.substr(0, length), "grid.asc"), MeshError);
  }
}

TEST_CASE("GeoTIFFs that are truncated, have a wrong header or lack blocks are refused") {
  const TemporaryFolder folder;
  const std::string whole = tiff_4x3().bytes();
  CHECK_NOTHROW(survey_of(folder, whole, "grid.tif"));
  for (std::size_t length = (whole.size() - 1) % 3; length < whole.size(); length += 3) {
    INFO("cut to " << length << " of " << whole.size() << " bytes");
    CHECK_THROWS_AS(survey_of(folder, whole.substr(0, length), "grid.tif"), MeshError);
  }
  Tiff lying = tiff_4x3();
  lying.columns = 200000;
  lying.rows = 200000;
  CHECK(has(survey_error(folder, lying.bytes(), "grid.tif"), "promises"));
  lying.columns = 40;
  lying.rows = 30;
  CHECK(has(survey_error(folder, lying.bytes(), "grid.tif"), "truncated or damaged"));
  Tiff sparse = tiff_4x3();
  sparse.sparse = true;
  CHECK(has(survey_error(folder, sparse.bytes(), "grid.tif"), "blocks without data"));
}

TEST_CASE("Heights of 9999 m mark missing ones where no NODATA value is declared") {
  const TemporaryFolder folder;
  std::string bare = text_grid(rows_4x3);
  const std::string nodata = "NODATA_value -9999\n";
  bare.erase(bare.find(nodata), nodata.size());
  CHECK(std::isnan(survey_of(folder, bare, "grid.asc").at(2, 1)));  // ESRI's default
  Tiff tiff = tiff_4x3();
  for (const float missing : {-9999.0f, 9999.0f}) {
    tiff.heights[6] = missing;
    CHECK(has(survey_error(folder, tiff.bytes(), "grid.tif"),
              "row 2, column 3: a height of " + std::to_string(static_cast<int>(missing)) +
                  " m; if it marks missing data, declare it with gdal_edit.py -a_nodata " +
                  std::to_string(static_cast<int>(missing))));
  }
  tiff.nodata = "-32768";
  CHECK(survey_of(folder, tiff.bytes(), "grid.tif").at(2, 1) == 9999.0);
  CHECK(has(
      survey_error(folder, text_grid("-1 -2 -3 -4\n-5 -6 99999 -8\n-9 -10 -11 -12\n"), "grid.asc"),
      "with a line NODATA_value 99999"));
}

TEST_CASE("Grids that are rotated, in degrees or in feet are refused with the remedy") {
  const TemporaryFolder folder;
  Tiff turned = tiff_4x3();
  turned.transform = {500000, 0.8, 0.6, 4000000, 0.6, -0.8};
  CHECK(has(survey_error(folder, turned.bytes(), "grid.tif"), "gdalwarp"));
  Tiff mirrored = tiff_4x3();
  mirrored.transform = {500000, -1, 0, 4000000, 0, -1};
  CHECK(has(survey_error(folder, mirrored.bytes(), "grid.tif"),
            "expected positive sizes; make it north-up with"));
  Tiff degrees = tiff_4x3();
  degrees.geographic = true;
  degrees.epsg = 4326;
  degrees.transform = {-70.7, 1e-4, 0, 42.2, 0, -1e-4};
  CHECK(has(survey_error(folder, degrees.bytes(), "grid.tif"), "degrees"));
  CHECK(has(survey_error(folder, degrees.bytes(), "grid.tif"), "gdalwarp -t_srs"));
  Tiff feet = tiff_4x3();
  feet.epsg = 2249;  // Massachusetts, US survey feet
  CHECK(has(survey_error(folder, feet.bytes(), "grid.tif"), "0.3048"));
  // A text grid names no unit.
  const std::string bare =
      "ncols 2\nnrows 2\nxllcorner -70.5\nyllcorner 42.1\ncellsize 0.0008333\n-1 -2\n-3 -4\n";
  Tiff mercator = tiff_4x3();
  mercator.epsg = 3857;
  mercator.transform = {-7870000, 1, 0, 5300000, 0, -1};  // 43 degrees north
  CHECK(has(survey_error(folder, mercator.bytes(), "grid.tif"),
            "map metres that are 0.73 m on Earth"));
  Tiff off_map = tiff_4x3();
  off_map.transform = {32500000, 1, 0, 6100000, 0, -1};  // with the zone before the easting
  CHECK(has(survey_error(folder, off_map.bytes(), "grid.tif"),
            "lies at 32500002 m east and 6099998 m north, off the map of its coordinate reference "
            "system; declare the right one with"));
  CHECK(has(survey_error(folder, bare, "grid.asc"), "seems to be in degrees"));
  const auto with_cell = [&](const std::string& cell) {
    std::string text = bare;
    text.replace(text.find("0.0008333"), 9, cell);
    return survey_error(folder, text, "grid.asc");
  };
  CHECK(has(with_cell("0.0166667"), "seems to be in degrees"));  // a minute
  for (const char* const cell : {"0.01", "0.02", "0.05", "0.025"}) CHECK(with_cell(cell).empty());
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
    const HeightRange range = heights(field);
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
  const std::string whole = read_text(*file);
  REQUIRE_NOTHROW(survey_of(folder, whole, "grid.bag"));
  for (int part = 0; part < 20; ++part)
    CHECK_THROWS_AS(
        survey_of(folder, whole.substr(0, whole.size() * static_cast<std::size_t>(part) / 20),
                  "grid.bag"),
        MeshError);
}

TEST_CASE("A survey's windows have the heights of the whole") {
  const TemporaryFolder folder;
  const Heightfield whole = survey_of(folder, text_grid(rows_4x3), "grid.asc", 0.5);
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

TEST_CASE("Rows of a wide survey are kept in memory, but no more than 256 MiB of them") {
  const TemporaryFolder folder;
  const auto read_two = [&](std::uint32_t columns) {
    Tiff tiff;
    tiff.columns = columns;
    tiff.rows = 2;
    tiff.transform = {500000, 1e-3, 0, 4000000, 0, -1e-3};
    tiff.nodata = "-9999";  // else a hole of the file would be refused
    const std::filesystem::path file = folder / "wide.tif";
    write_text(file, tiff.bytes());  // then zeros, which take no place on the disk
    std::filesystem::resize_file(file, std::filesystem::file_size(file) + std::size_t{8} * columns);
    std::vector<double> z_m(8);
    survey_tiles(file, 5.0)(0, 0, 4, 2, z_m, {});
    CHECK(z_m == std::vector<double>(8, -5.0));
    return GDALGetCacheMax64();
  };
  CHECK(read_two(1000) == 64 << 20);
  CHECK(read_two(20000) == 1400 * 80000);
  CHECK(read_two(600000) == 256 << 20);
#ifdef ENSONIFY_CAN_LIMIT_MEMORY
  const LittleMemory little(std::size_t{1} << 26);
  CHECK_THROWS_WITH(read_two(30000000),
                    Catch::Contains("there is not enough memory") && !Catch::Contains("damaged"));
#endif
}
