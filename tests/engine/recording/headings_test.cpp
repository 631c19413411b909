// Which headings of a recording are the vehicle's.

#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "support/catch.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/recording/headings.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

/// 100 pings half a metre apart on this course, with these headings in every ping.
RecordedLine line_on_course(double course_deg, std::optional<double> heading_deg,
                            std::optional<double> gyro_deg = {}, double step_m = 0.5) {
  RecordedLine line;
  for (int i = 0; i < 100; ++i) {
    RecordedPing ping;
    const double way_m = step_m * i, earth_m = 6371e3, latitude_rad = 60.0 * degree;
    ping.place =
        GeographicPlace{latitude_rad + way_m * std::cos(course_deg * degree) / earth_m,
                        way_m * std::sin(course_deg * degree) / earth_m / std::cos(latitude_rad)};
    if (heading_deg) ping.heading_rad = *heading_deg * degree;
    if (gyro_deg) ping.gyro_rad = *gyro_deg * degree;
    line.pings.push_back(ping);
  }
  return line;
}

/// The heading of ping 50 in degrees; unset: the course.
std::optional<double> chosen_deg(const RecordedLine& line) {
  const std::optional<double> rad = choose_headings(line).rad[50];
  return rad ? std::optional(*rad / degree) : std::nullopt;
}

}  // namespace

TEST_CASE("stated headings that may be right are the headings") {
  for (const double course_deg : {0.0, 90.0, 200.0, 330.0})
    for (const double crab_deg : {-50.0, 0.0, 20.0}) {
      const RecordedLine line = line_on_course(course_deg, course_deg + crab_deg, course_deg + 5.0);
      CHECK(chosen_deg(line).value() == Approx(course_deg + crab_deg));
      CHECK(choose_headings(line).instead.empty());
    }
  CHECK(choose_headings(line_on_course(90.0, std::nullopt)).instead.empty());
  CHECK_FALSE(chosen_deg(line_on_course(90.0, std::nullopt)));
}

TEST_CASE("a heading of 0 in every ping is not used if the course or the gyro contradicts it") {
  const ChosenHeadings gyro = choose_headings(line_on_course(90.0, 0.0, 92.0));
  CHECK(gyro.rad[50].value() == Approx(92.0 * degree));
  CHECK(gyro.of_gyro);
  CHECK_THAT(gyro.instead, Catch::StartsWith("the heading is 0 in every ping") &&
                               Catch::Contains("90 degrees off") && Catch::Contains("gyro"));
  const ChosenHeadings course = choose_headings(line_on_course(90.0, 0.0));
  CHECK_FALSE(course.rad[50]);
  CHECK_FALSE(course.of_gyro);
  CHECK(course.instead ==
        "the heading is 0 in every ping, but the course is 90 degrees off it; the course is the "
        "heading");
  // Due north it may be right.
  for (const double course_deg : {0.0, 5.0, -8.0}) {
    CHECK(chosen_deg(line_on_course(course_deg, 0.0)).value() == 0.0);
    CHECK(choose_headings(line_on_course(course_deg, 0.0)).instead.empty());
  }
  // Without a course the gyro decides, and without both nothing contradicts.
  CHECK(chosen_deg(line_on_course(90.0, 0.0, 92.0, 0.0)).value() == Approx(92.0));
  CHECK(chosen_deg(line_on_course(90.0, 0.0, std::nullopt, 0.0)).value() == 0.0);
  // One other heading shows that the field is used.
  RecordedLine line = line_on_course(30.0, 0.0);
  line.pings[7].heading_rad = 1.0 * degree;
  CHECK(chosen_deg(line).value() == 0.0);
}

TEST_CASE("headings far off the course are replaced by a gyro that is not, else by the course") {
  for (const double off_deg : {70.0, 180.0, -90.0}) {
    CAPTURE(off_deg);
    CHECK(chosen_deg(line_on_course(200.0, 200.0 + off_deg, 190.0)).value() == Approx(190.0));
    const ChosenHeadings course = choose_headings(line_on_course(200.0, 200.0 + off_deg, 100.0));
    CHECK_FALSE(course.rad[50]);
    CHECK_THAT(course.instead,
               Catch::Contains("degrees off the course, unless port and starboard") &&
                   Catch::EndsWith("; the course is the heading"));
  }
}

TEST_CASE("the gyro is the heading where most pings have no other") {
  RecordedLine line = line_on_course(200.0, 190.0, 195.0);
  CHECK(chosen_deg(line).value() == Approx(190.0));
  for (std::size_t i = 0; i < 60; ++i) line.pings[i].heading_rad.reset();
  const ChosenHeadings gyro = choose_headings(line);
  CHECK(gyro.rad[80].value() == Approx(195.0 * degree));
  CHECK(gyro.instead == "most pings have no heading; the ship's gyro is the heading");
  for (std::size_t i = 0; i < 60; ++i) line.pings[i].gyro_rad.reset();
  CHECK(choose_headings(line).rad[80].value() == Approx(190.0 * degree));  // what there is
}

TEST_CASE("places in metres, over the date line, and far wrong fixes give the same course") {
  RecordedLine metres = line_on_course(90.0, 0.0);
  for (std::size_t i = 0; i < 100; ++i) {
    metres.pings[i].place.reset();
    metres.pings[i].place_m = Eigen::Vector2d(5e5 + 0.5 * static_cast<double>(i), 6e6);
  }
  CHECK_FALSE(chosen_deg(metres));
  RecordedLine line = line_on_course(0.0, 10.0);
  for (std::size_t i = 0; i < 100; ++i)
    line.pings[i].place->longitude_rad = (i % 2 == 0 ? 180.0 : -180.0) * degree;
  CHECK(chosen_deg(line).value() == Approx(10.0));
  line.pings[50].place = GeographicPlace{1.0, -2.0};
  line.pings[51].place.reset();
  CHECK(chosen_deg(line).value() == Approx(10.0));
}
