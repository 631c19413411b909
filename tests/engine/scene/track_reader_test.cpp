#include <ensonify/engine/scene/tables/track_reader.h>

#include <cmath>
#include <cstring>
#include <limits>

#include <fmt/format.h>

#include "support/catch.h"
#include "support/data.h"
#include "support/files.h"
#include "support/message.h"
#include "support/small_recording.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/output/jsf.h>
#include <ensonify/engine/output/xtf.h>
#include <ensonify/engine/seafloor/bed/geographic.h>
#include <ensonify/engine/seafloor/bed/reference_map.h>
#include <ensonify/engine/seafloor/bed/survey.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

NavigationLog parsed_track(const std::string& text, const TrackOptions& track = {},
                           const LocalFrame& frame = {}) {
  return parse_track(text, "t.csv", track, frame);
}

std::string track_error(const std::string& text, const LocalFrame& frame = {}) {
  return tests::message_thrown<SceneError>([&] { parsed_track(text, {}, frame); }, "accepted");
}

const LocalFrame survey{{405000.0, 6202000.0, 0.0}, true, 0};

}  // namespace

TEST_CASE("a track's columns can have any of their names, in any order") {
  const NavigationLog log = parsed_track(
      "heading_deg,time_s,y_m,x_m,depth_m,altitude_m,roll_deg,speed\n90,5,2,1,7,3,-1,9\n91,6,2,3,8,"
      "3,-1,9\n",
      {.middle_east_m = 100.0, .middle_north_m = 10.0});
  CHECK(log.t_s == std::vector<double>{5, 6});
  CHECK(log.x_m == std::vector<double>{101, 103});
  CHECK(log.y_m == std::vector<double>{12, 12});
  CHECK(log.z_m == std::vector<double>{-7, -8});
  CHECK(log.altitude_m == std::vector<double>{3, 3});
  CHECK(log.heading_rad[1] == 91 * degree);
  CHECK(log.roll_rad[0] == -degree);
  CHECK(log.pitch_rad.empty());
  const NavigationLog world =
      parsed_track("t_s,easting_m,northing_m\n0,405010,6201990\n", {}, survey);
  CHECK(world.x_m == std::vector<double>{10});
  CHECK(world.y_m == std::vector<double>{-10});
}

TEST_CASE("latitudes go to the given origin, the survey's zone, or the middle of the seabed") {
  const std::string text =
      "t_s,lat_deg,lon_deg,heading_deg\n0,48.445,-68.829,0\n1,48.446,-68.827,0\n";
  NavigationLog log;
  try {
    log = parsed_track(text);
  } catch (const SceneError& error) {
    CHECK(std::string(error.what()).find("GeographicLib") != std::string::npos);
    WARN("skipped: built without GeographicLib");
    return;
  }
  CHECK(log.x_m[0] == Approx(-log.x_m[1]).epsilon(1e-4));
  CHECK(log.y_m[1] - log.y_m[0] == Approx(111.2).margin(0.1));
  // A heading counts from true north at its place, which is 0.001 degrees west of the middle.
  CHECK(log.heading_rad[0] / degree == Approx(0.001 * std::sin(48.445 * degree)).epsilon(1e-3));
  CHECK(log.origin.value().latitude_rad == Approx(48.4455 * degree).epsilon(1e-12));
  CHECK(log.origin.value().longitude_rad == Approx(-68.828 * degree).epsilon(1e-12));

  // Over the meridian of 180 degrees, however longitudes are counted.
  for (const std::string last : {"-179.9999", "180.0001"}) {
    const NavigationLog over =
        parsed_track("t_s,lat_deg,lon_deg\n0,-17,179.9999\n1,-17," + last + "\n");
    CHECK(over.x_m[0] == Approx(-10.65).margin(0.01));
    CHECK(over.x_m[1] == Approx(10.65).margin(0.01));
  }

  const NavigationLog about = parsed_track(
      text, {.origin_latitude_rad = 48.445 * degree, .origin_longitude_rad = -68.829 * degree});
  CHECK_FALSE(about.origin);
  CHECK(about.x_m[0] == Approx(0.0).margin(1e-6));
  CHECK(about.x_m[1] == Approx(log.x_m[1] - log.x_m[0]).epsilon(1e-4));

  // In zone 19 the same place lies where UTM says, and headings count from the grid's north.
  const MapPlace map = utm_place({48.445 * degree, -68.829 * degree}, 19);
  const LocalFrame utm{{map.place.x() - 5.0, map.place.y() + 3.0, 0.0}, true, 19};
  const NavigationLog grid = parsed_track(text, {}, utm);
  CHECK(grid.x_m[0] == Approx(5.0).margin(1e-6));
  CHECK(grid.y_m[0] == Approx(-3.0).margin(1e-6));
  CHECK(grid.heading_rad[0] == Approx(-map.convergence_rad));

  // A survey's own reference system places it, whatever origin is given: five degrees east of that
  // system's middle its north is four degrees off, and back on Earth the places are those given.
  const std::string reference = reference_about({54.0 * degree, 0.0}, Eigen::Vector3d::Zero());
  const MapPlace middle = map_of_reference(reference)({55.0 * degree, 5.0 * degree});
  LocalFrame mapped{{middle.place.x(), middle.place.y(), 0.0}, true};
  mapped.reference = reference;
  const NavigationLog placed = parsed_track(
      "t_s,lat_deg,lon_deg,heading_deg\n0,55,5,0\n1,55.002,5.003,0\n",
      {.origin_latitude_rad = 10.0 * degree, .origin_longitude_rad = 100.0 * degree}, mapped);
  const PlaceOfMap back = place_of_reference(reference);
  for (const std::size_t row : {0u, 1u}) {
    const GeographicPlace where =
        back(middle.place + Eigen::Vector2d(placed.x_m[row], placed.y_m[row])).where;
    CHECK(where.latitude_rad / degree == Approx(row == 0 ? 55.0 : 55.002).epsilon(1e-12));
    CHECK(where.longitude_rad / degree == Approx(row == 0 ? 5.0 : 5.003).epsilon(1e-12));
  }
  CHECK(placed.heading_rad[0] / degree == Approx(-5.0 * std::sin(55.0 * degree)).margin(0.02));

  CHECK(
      track_error(text, survey).starts_with("t.csv: lat_deg and lon_deg cannot be put onto this"));
}

TEST_CASE("the table of a run is a track, also over holes, where it has no altitude") {
  const std::string table = "t_s,x_m,y_m,z_m,altitude_m\n0,0,0,-5,3\n1,1,0,-5,\n";
  CHECK(parsed_track(table).z_m == std::vector<double>{-5, -5});
  CHECK(parsed_track(table).altitude_m.empty());
  CHECK(track_error("t_s,x_m,y_m,altitude_m\n0,0,0,3\n1,1,0,\n") ==
        "t.csv:3: altitude_m is empty, expected a number");
}

TEST_CASE("a column of a track that goes by another name is warned of") {
  const auto warnings = [](const std::string& columns) {
    return parsed_track("t_s,x_m,y_m," + columns + "\n0,0,0,1,1\n").warnings;
  };
  for (const char* name : {"heading", "Heading_deg", "heading_rad", "yaw", "HDG"})
    CHECK(warnings(std::string("z_m,") + name) ==
          std::vector<std::string>{fmt::format(
              "t.csv: its column '{}' is not read; if it is heading_deg, name it so", name)});
  CHECK(warnings("Roll,Depth").size() == 2);
  CHECK(warnings("Z,pitch_rad").size() == 2);
  CHECK(warnings("speed,zone").empty());
  CHECK(warnings("z_m,altitude").empty());               // it has a height
  CHECK(warnings("heading_deg,heading_sigma").empty());  // it has a heading
}

TEST_CASE("an error in a track names its line") {
  CHECK(track_error("x_m,y_m\n0,0\n").starts_with("t.csv: no column of times in the header row"));
  CHECK(track_error("t_s,x_m\n0,0\n") == "t.csv: there is a column x_m and no y_m, expected both");
  CHECK(track_error("t_s\n0\n").starts_with("t.csv: no columns of places"));
  CHECK(track_error("t_s,x_m,y_m\n0,0,0\n\n# so\n0,1,0\n") ==
        "t.csv:5: t_s is 0, not after 0 of the row before, expected times that ascend");
  CHECK(track_error("t_s,x_m,y_m\n0,0,nan\n").starts_with("t.csv:2: y_m is 'nan'"));
  CHECK(track_error("t_s,x_m,y_m\n0,1e300,0\n").starts_with("t.csv:2: x_m is 1e+300"));
  CHECK(track_error("t_s,lat_deg,lon_deg\n0,91,0\n").starts_with("t.csv:2: lat_deg is 91"));
  CHECK(track_error("t_s,easting_m,northing_m\n0,1,1\n")
            .starts_with("t.csv: easting_m and northing_m"));
  CHECK(track_error("t_s,x_m,y_m\n").starts_with("t.csv:1: no pose follows"));
}

TEST_CASE("an XTF or JSF recording is a track: the navigation of its pings") {
  const tests::TemporaryFolder folder;
  Recording recording = tests::small_recording();
  recording.pings[1].unix_ms = recording.pings[0].unix_ms;  // not after the ping before: left out
  for (NavPing& ping : recording.pings) ping.heading_rad -= 90.0 * degree;  // along the track
  for (const bool jsf : {false, true}) {
    CAPTURE(jsf);
    const std::filesystem::path file = folder / "line";
    tests::write_text(
        file, tests::as_text(jsf ? encode_jsf({&recording, 1}) : encode_xtf({&recording, 1})));
    const NavigationLog log = read_track({.kind = TrackKind::file, .file = {"line", file}}, {});
    REQUIRE(log.t_s.size() == 2);
    CHECK(log.t_s[1] - log.t_s[0] == Approx(0.5).margin(1e-3));
    // The tangent plane about the middle of two places 2e-4 degrees of latitude apart.
    CHECK(log.y_m[1] - log.y_m[0] == Approx(2e-4 * 111330.0).epsilon(2e-3));
    CHECK(log.z_m == std::vector{-12.5, -12.5});
    CHECK(log.altitude_m == std::vector{7.25, 7.25});
    CHECK(log.heading_rad[1] == Approx(12.0 * degree).margin(1e-4));
    CHECK(log.warnings.size() == 1);
  }
  std::string back = tests::as_text(encode_jsf({&recording, 1}));
  const std::size_t last = back.size() / 3 * 2;
  for (const std::size_t at : {last, last + back.size() / 6}) {  // the last ping's messages
    const std::int32_t unix_s = 1709251190;
    std::memcpy(back.data() + at + 16, &unix_s, sizeof unix_s);
  }
  tests::write_text(folder / "line", back);
  const NavigationLog log =
      read_track({.kind = TrackKind::file, .file = {"line", folder / "line"}}, {});
  REQUIRE(log.warnings.size() == 2);
  CHECK_THAT(log.warnings[0], Catch::Contains("1 of 3 pings have times before"));
  CHECK_THAT(log.warnings[1], Catch::Contains("line: 2 of its 3 pings are left out"));
  for (NavPing& ping : recording.pings) ping.place = {};
  tests::write_text(folder / "line", tests::as_text(encode_xtf({&recording, 1})));
  try {
    read_track({.kind = TrackKind::file, .file = {"line", folder / "line"}}, {});
    FAIL("accepted");
  } catch (const SceneError& error) {
    CHECK(std::string(error.what())
              .ends_with("none of its 3 pings has a time and a position, so it "
                         "is no track; give a CSV file"));
  }
}

TEST_CASE("the headings of a recording that are not the vehicle's are replaced, with a warning") {
  const tests::TemporaryFolder folder;
  Recording recording = tests::small_recording();
  for (NavPing& ping : recording.pings)  // 13 m east from ping to ping
    ping.place = {55.0 * degree, 2e-4 * degree * static_cast<double>(ping.row)};
  std::string bytes = tests::as_text(encode_xtf({&recording, 1}));
  const std::size_t packet = (bytes.size() - 1024) / 3;
  const auto put_in_all = [&](std::size_t offset, float degrees) {
    for (std::size_t i = 0; i < 3; ++i)
      std::memcpy(bytes.data() + 1024 + i * packet + offset, &degrees, sizeof degrees);
  };
  put_in_all(212, 0.0f);
  const auto track = [&] {
    tests::write_text(folder / "line", bytes);
    return read_track({.kind = TrackKind::file, .file = {"line", folder / "line"}}, {});
  };
  const NavigationLog course = track();
  CHECK(course.heading_rad.empty());
  REQUIRE(course.warnings.size() == 1);
  CHECK_THAT(
      course.warnings[0],
      Catch::EndsWith("line: the heading is 0 in every ping, but the course is 90 degrees off "
                      "it; the course is the heading"));
  put_in_all(124, 92.0f);
  const NavigationLog gyro = track();
  REQUIRE(gyro.heading_rad.size() == 3);
  // From true north; the plane's north is turned against it by parts of a degree at most.
  CHECK(gyro.heading_rad[1] == Approx(92.0 * degree).margin(1e-3));
  CHECK_THAT(gyro.warnings.at(0), Catch::EndsWith("; the ship's gyro is the heading"));
}

TEST_CASE("pings of a recording without a place are counted") {
  const tests::TemporaryFolder folder;
  Recording recording = tests::small_recording();
  for (NavPing& ping : recording.pings) ping.heading_rad = 0.0;
  recording.pings[1].place = {};
  tests::write_text(folder / "line", tests::as_text(encode_xtf({&recording, 1})));
  const NavigationLog log =
      read_track({.kind = TrackKind::file, .file = {"line", folder / "line"}}, {});
  CHECK(log.t_s.size() == 2);
  REQUIRE(log.warnings.size() == 1);
  CHECK_THAT(log.warnings[0],
             Catch::EndsWith("line: 1 of its 3 pings have no time or no position and "
                             "are left out; the track goes on between the others"));
}

TEST_CASE("a height or an angle that some pings of a recording lack is interpolated") {
  const tests::TemporaryFolder folder;
  Recording recording = tests::small_recording();
  const NavPing ping = recording.pings[0];
  recording.pings.assign(6, ping);
  for (int i = 0; i < 6; ++i) {
    NavPing& at = recording.pings[static_cast<std::size_t>(i)];
    at.unix_ms += 100 * i + (i > 3 ? 200 : 0);
    at.place.latitude_rad += 1e-7 * i;
    at.depth_m = 0.0;  // not stated
    at.altitude_m = 5.0 + i;
    at.heading_rad = (i < 3 ? 357.0 + i : i - 3.0) * degree;
  }
  // The bed was not found in one ping, the altitude of the first was not known.
  recording.pings[0].altitude_m = recording.pings[4].altitude_m = 0.0;
  std::string bytes = tests::as_text(encode_xtf({&recording, 1}));
  const std::size_t packet = (bytes.size() - 1024) / 6;
  const float none = std::numeric_limits<float>::quiet_NaN();
  for (const std::size_t i : {2u, 3u})  // with headings of 359 and 0 degrees
    std::memcpy(bytes.data() + 1024 + i * packet + 212, &none, sizeof none);
  tests::write_text(folder / "line", bytes);
  const NavigationLog log =
      read_track({.kind = TrackKind::file, .file = {"line", folder / "line"}}, {});
  REQUIRE(log.altitude_m.size() == 6);
  CHECK(log.altitude_m[0] == Approx(6.0));                    // as the next one
  CHECK(log.altitude_m[4] == Approx(8.0 + 2.0 * 300 / 400));  // 0.3 of 0.4 s after 8 m, before 10 m
  REQUIRE(log.heading_rad.size() == 6);
  for (const std::size_t i : {2u, 3u}) {  // from 358 degrees at 0.1 s to 1 degree at 0.6 s
    const double deg = 358.0 + 3.0 * (0.1 * static_cast<double>(i) - 0.1) / 0.5;
    CHECK(std::remainder(log.heading_rad[i] / degree - deg, 360.0) == Approx(0.0).margin(1e-3));
  }
  REQUIRE(log.warnings.size() == 2);
  CHECK(log.warnings[0].ends_with(
      "line: 2 of its 6 pings have no altitude_m, which is interpolated between the others"));
  CHECK_THAT(log.warnings[1], Catch::Contains("2 of its 6 pings have no heading_deg"));

  // Of no use are altitudes next to depths, and what most pings lack.
  for (NavPing& at : recording.pings) at.depth_m = 12.0;
  for (const std::size_t i : {1u, 2u, 3u}) recording.pings[i].altitude_m = 0.0;
  tests::write_text(folder / "line", tests::as_text(encode_xtf({&recording, 1})));
  TrackOptions track{.kind = TrackKind::file, .file = {"line", folder / "line"}};
  CHECK(read_track(track, {}).warnings.empty());
  track.vertical = Vertical::altitude;
  const NavigationLog over_bed = read_track(track, {});
  CHECK(over_bed.altitude_m.empty());
  REQUIRE(over_bed.warnings.size() == 1);
  CHECK(over_bed.warnings[0].ends_with("5 of its 6 pings have no altitude_m, which is not used"));
}

TEST_CASE("the track of an XTF of several beams is that of the middle of the beams") {
  const tests::TemporaryFolder folder;
  Recording recording = tests::small_recording();
  recording.full_scale.resize(3, recording.full_scale.front());
  for (int beam = 0; beam < 3; ++beam) {  // three beams of one ping, and from north to south
    NavPing& ping = recording.pings[static_cast<std::size_t>(beam)];
    ping.beam = beam;
    ping.unix_ms = recording.pings[0].unix_ms;
    ping.place.latitude_rad = (55.0 - 1e-5 * beam) * degree;
  }
  recording.pings.push_back(recording.pings[0]);  // the next ping's place is its rear beam's
  recording.pings.back().unix_ms += 500;
  tests::write_text(folder / "line", tests::as_text(encode_xtf({&recording, 1})));
  const NavigationLog log =
      read_track({.kind = TrackKind::file, .file = {"line", folder / "line"}}, {});
  REQUIRE(log.t_s.size() == 2);
  CHECK(log.y_m[1] - log.y_m[0] == Approx(1e-5 * 111330.0).epsilon(2e-3));
}

TEST_CASE("a real recording's navigation is steady after smoothing") {
  const auto file = tests::data_file("nav/scotsman_iver2_nav.csv");
  if (!file) {
    WARN("skipped: the recording is not there");
    return;
  }
  const NavigationLog log = read_track({.kind = TrackKind::file, .file = {"nav.csv", *file}}, {});
  REQUIRE(log.t_s.size() == 460);
  CHECK(log.repeated_places() > 150);
  const RecordedTrack track(log, 3.0);
  // The recording's own speeds are 1.71 to 2.24 knots.
  for (double t_s = log.t_s.front() + 1.0; t_s < log.t_s.back() - 1.0; t_s += 0.05) {
    const double speed_kn = track.at(t_s).velocity_mps.head<2>().norm() / 0.514444;
    REQUIRE(speed_kn > 1.3);
    REQUIRE(speed_kn < 2.7);
  }
  double farthest_m = 0.0;  // from the places as they come; repeated ones are as old as 0.7 s
  for (std::size_t i = 1; i < log.t_s.size(); ++i) {
    const Eigen::Vector2d place{log.x_m[i], log.y_m[i]};
    if (place == Eigen::Vector2d(log.x_m[i - 1], log.y_m[i - 1])) continue;
    farthest_m = std::max(farthest_m, (track.at(log.t_s[i]).position.head<2>() - place).norm());
  }
  CHECK(farthest_m < 0.4);
}
