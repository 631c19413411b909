#include <ensonify/engine/seafloor/bed/survey_formats.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <ensonify/engine/seafloor/bed/survey.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/surveys.h"
#include "support/temporary_folder.h"

using namespace ensonify::engine;
using namespace ensonify::tests;

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
  write_text(folder / "a & b.npy", npy<double>("<f8", "(3, 3)",
                                               {-1, -2, -3, -4, -5, -6, -7, -8,
                                                std::numeric_limits<double>::quiet_NaN()}));
  const SurveyFile file{folder / "a & b.npy", 2.0};
  const Heightfield field = read_survey(file, 0.0);
  CHECK(std::isnan(field.at(2, 2)));
  CHECK(field.at(1, 2) == -8.0);
  std::vector<double> window(2);
  survey_tiles(file, 0.0)(1, 1, 2, 1, window, {});
  CHECK(window == std::vector<double>{-5, -6});
  CHECK(read_survey_header(file).reference.empty());
}

TEST_CASE("the cell size of an .npy file is in metres, however small") {
  const TemporaryFolder folder;
  const std::string grid = npy<double>("<f8", "(2, 2)", {-1, -2, -3, -4});
  for (const double cell_m : {0.001, 0.002, 1.0 / 3600.0})
    CHECK(survey_error(folder, grid, "a.npy", cell_m).empty());
}

TEST_CASE("faults of an .npy file are named, and so is a cell size that is missing or too much") {
  const TemporaryFolder folder;
  const std::vector<double> six{-1, -2, -3, -4, -5, -6};
  const std::string good = npy("<f8", "(2, 3)", six);
  const auto fault = [&](const std::string& bytes, const std::string& part, double cell_m = 1.0) {
    CHECK(has(survey_error(folder, bytes, "a.npy", cell_m), part));
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
  CHECK(has(survey_error(folder, text_grid(rows_4x3), "grid.asc", 1.0),
            "leave seafloor.survey_cell_m (--survey-cell-m) out"));
}

TEST_CASE("a damaged .npy file is read or refused, and nothing else happens") {
  const TemporaryFolder folder;
  const std::vector<double> heights{-1, -2, -3, -4, -5, -6, -7, -8, -9, -10, -11, -12};
  CHECK(refused_when_damaged(folder, npy("<f8", "(3, 4)", heights), "a.npy", 1.0) > 40);
}
