#include <cmath>
#include <limits>
#include <memory>

#include "support/catch.h"

#include <ensonify/scatter/angle.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/strength_table.h>

using namespace ensonify::scatter;

namespace {

std::shared_ptr<const StrengthTable> two_frequencies() {
  return std::make_shared<const StrengthTable>(std::vector<StrengthCurve>{
      {100e3, {10.0 * degree, 30.0 * degree, 80.0 * degree}, {-35.0, -25.0, -15.0}},
      {400e3, {20.0 * degree, 60.0 * degree}, {-30.0, -20.0}}});
}

double measured_strength_db(double frequency_hz, double grazing_deg, double offset_db = 0.0) {
  return to_db(MeasuredBottom(two_frequencies(), frequency_hz, offset_db)
                   .cross_section(grazing_deg * degree));
}

}  // namespace

TEST_CASE("a table's strengths are met, and between them decibels are linear over the angle") {
  CHECK(measured_strength_db(100e3, 10.0) == Approx(-35.0));
  CHECK(measured_strength_db(100e3, 30.0) == Approx(-25.0));
  CHECK(measured_strength_db(100e3, 15.0) == Approx(-32.5));
  CHECK(measured_strength_db(100e3, 70.0) == Approx(-17.0));
  CHECK(measured_strength_db(400e3, 40.0) == Approx(-25.0));
  CHECK(measured_strength_db(100e3, 15.0, -3.5) == Approx(-36.0));
}

TEST_CASE("between two frequencies of a table decibels are linear over the octaves") {
  CHECK(measured_strength_db(200e3, 20.0) == Approx(0.5 * (-30.0 - 30.0)));
  CHECK(measured_strength_db(200e3, 60.0) == Approx(0.5 * (-19.0 - 20.0)));
  CHECK(measured_strength_db(100e3 * std::pow(4.0, 0.25), 60.0) ==
        Approx(0.75 * -19.0 + 0.25 * -20.0));
}

TEST_CASE("outside a table the last value holds, and towards grazing Lambert's law") {
  CHECK(measured_strength_db(100e3, 90.0) == Approx(-15.0));
  CHECK(measured_strength_db(50e3, 30.0) == measured_strength_db(100e3, 30.0));
  CHECK(measured_strength_db(1e6, 40.0) == measured_strength_db(400e3, 40.0));
  CHECK(measured_strength_db(100e3, 2.0) ==
        Approx(-35.0 + 20.0 * std::log10(std::sin(2.0 * degree) / std::sin(10.0 * degree))));
  const BackscatterTable table{MeasuredBottom(two_frequencies(), 100e3)};
  CHECK(std::isfinite(table.sigma_over_sine(0.0)));
  CHECK(table.sigma_over_sine(0.0) < table.sigma_over_sine(0.01));
  // A table may begin at 0.
  const auto from_zero = std::make_shared<const StrengthTable>(
      std::vector<StrengthCurve>{{0.0, {0.0, 1.0}, {-60.0, -20.0}}});
  CHECK(to_db(MeasuredBottom(from_zero, 5e5).cross_section(0.0)) == Approx(-60.0).margin(1e-3));
}

TEST_CASE("the table of the hot loop follows a measured table") {
  const MeasuredBottom bed(two_frequencies(), 150e3);
  const BackscatterTable table(bed);
  for (double g = 0.5; g <= 90.0; g += 0.0173)
    REQUIRE(std::abs(to_db(table.sigma_over_sine(std::sin(g * degree)) * std::sin(g * degree) /
                           bed.cross_section(g * degree))) < 0.03);
}

TEST_CASE("curves that are not in order are refused") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const std::vector<StrengthCurve>& curves : std::vector<std::vector<StrengthCurve>>{
           {},
           {{1e5, {0.1}, {-20.0}}},
           {{1e5, {0.1, 0.1}, {-20.0, -20.0}}},
           {{1e5, {0.1, 1.6}, {-20.0, -20.0}}},
           {{1e5, {0.1, 0.2}, {-20.0}}},
           {{1e5, {0.1, 0.2}, {-20.0, nan}}},
           {{1e5, {0.1, nan}, {-20.0, -20.0}}},
           {{1e5, {0.1, 0.2}, {-20.0, -20.0}}, {1e5, {0.1, 0.2}, {-20.0, -20.0}}},
           {{0.0, {0.1, 0.2}, {-20.0, -20.0}}, {1e5, {0.1, 0.2}, {-20.0, -20.0}}}})
    CHECK_THROWS_WITH(StrengthTable(curves), Catch::Contains("increasing frequency"));
}
