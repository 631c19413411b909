// Recordings of whole runs, read as other programs read them: only from their bytes.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <memory>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <ogr_spatialref.h>

#include "support/at.h"
#include "support/catch.h"
#include "support/dark_bed.h"
#include "support/files.h"
#include "support/program.h"
#include "support/temporary_folder.h"

#include <ensonify/scatter/angle.h>

using namespace ensonify::tests;
using Eigen::Vector2d, Eigen::Vector3d;
using ensonify::scatter::degree;

namespace {

// A dark level bed, 20 m down, with a bright ball on it.
const std::string bed_with_ball = ensonify::tests::dark_bed + R"([[objects]]
shape = "sphere"
diameter_m = 0.2
material = "bright"
[output]
exr = false
xtf = true
jsf = true
[track]
origin_lat_deg = 55
origin_lon_deg = 10
speed_mps = 2
ping_interval_s = 0.05
altitude_m = 10
)";
const Vector2d ball_m{3.0, -2.0};
constexpr double radius_m = 0.1;

const std::string sonar = R"(
range_m = 30
bins = 600
elevations = 3000
focused = true
)";

/// Longitude and latitude.
using Place = Vector2d;

/// Metres east per degree of longitude and north per degree of latitude, from the ellipsoid's radii
/// of curvature.
Vector2d metres_a_degree(double latitude_deg) {
  constexpr double a_m = 6378137.0, e2 = 0.00669437999014;
  const double sine = std::sin(latitude_deg * degree), w2 = 1.0 - e2 * sine * sine;
  return degree * a_m / std::sqrt(w2) * Vector2d(std::cos(latitude_deg * degree), (1.0 - e2) / w2);
}

/// East and north of 55 N, 10 E.
Vector2d local_m(const Place& place_deg) {
  return (place_deg - Place(10.0, 55.0)).cwiseProduct(metres_a_degree(55.0));
}

/// One side of a ping, as in its file.
struct Line {
  int source = 0;  ///< channel of an XTF, subsystem of a JSF
  std::uint32_t number = 0;
  Place place_deg;
  double depth_m = 0.0, altitude_m = 0.0;
  double heading_deg = 0.0, pitch_deg = 0.0, roll_deg = 0.0;
  bool starboard = false;
  double sample_m = 0.0;
  std::vector<int> near_to_far;
};

std::vector<Line> read_xtf(const std::string& file) {
  std::vector<Line> lines;
  REQUIRE(at<std::uint16_t>(file, 164) == 3);  // latitudes and longitudes
  for (std::size_t packet = 1024; packet < file.size();
       packet += at<std::uint32_t>(file, packet + 10)) {
    REQUIRE(at<std::uint16_t>(file, packet) == 0xFACE);
    std::size_t channel = packet + 256;
    for (int k = 0; k < at<std::uint16_t>(file, packet + 4); ++k) {
      Line line{.source = at<std::uint16_t>(file, channel),
                .number = at<std::uint32_t>(file, packet + 28),
                .place_deg = {at<double>(file, packet + 168), at<double>(file, packet + 160)},
                .depth_m = at<float>(file, packet + 192),
                .altitude_m = at<float>(file, packet + 196),
                .heading_deg = at<float>(file, packet + 212),
                .pitch_deg = at<float>(file, packet + 204),
                .roll_deg = at<float>(file, packet + 208)};
      const auto info = static_cast<std::size_t>(256 + 128 * at<std::uint16_t>(file, channel));
      line.starboard = at<std::uint8_t>(file, info) == 2;
      const auto samples = at<std::uint32_t>(file, channel + 42);
      line.sample_m = at<float>(file, channel + 4) / samples;
      for (std::size_t i = 0; i < samples; ++i)
        line.near_to_far.push_back(at<std::uint16_t>(file, channel + 64 + 2 * i));
      if (!line.starboard) std::ranges::reverse(line.near_to_far);
      lines.push_back(std::move(line));
      channel += 64 + 2 * samples;
    }
  }
  return lines;
}

std::vector<Line> read_jsf(const std::string& file) {
  std::vector<Line> lines;
  constexpr double minute_degrees = 1e-4 / 60.0;
  for (std::size_t message = 0; message < file.size();
       message += 16 + at<std::uint32_t>(file, message + 12)) {
    REQUIRE(at<std::uint16_t>(file, message) == 0x1601);
    const std::size_t h = message + 16;
    REQUIRE(at<std::int16_t>(file, h + 88) == 2);
    Line line{.source = at<std::uint8_t>(file, message + 7),
              .number = at<std::uint32_t>(file, h + 8),
              .place_deg = {at<std::int32_t>(file, h + 80) * minute_degrees,
                            at<std::int32_t>(file, h + 84) * minute_degrees},
              .depth_m = at<std::int32_t>(file, h + 136) / 1000.0,
              .altitude_m = at<std::int32_t>(file, h + 144) / 1000.0,
              .heading_deg = at<std::uint16_t>(file, h + 172) / 100.0,
              .pitch_deg = at<std::int16_t>(file, h + 174) * 180.0 / 32768.0,
              .roll_deg = at<std::int16_t>(file, h + 176) * 180.0 / 32768.0,
              .starboard = at<std::uint8_t>(file, message + 8) == 1,
              .sample_m = at<float>(file, h + 148) / 2.0 * at<std::uint32_t>(file, h + 116) * 1e-9};
    for (std::size_t i = 0; i < at<std::uint16_t>(file, h + 114); ++i)
      line.near_to_far.push_back(at<std::int16_t>(file, h + 240 + 2 * i));
    lines.push_back(std::move(line));
  }
  return lines;
}

/// The position of a point abeam of the sonar at a slant range and a depth below the sonar.
Place place_abeam_deg(const Line& line, double range_m, double below_m) {
  const double h = line.heading_deg * degree, p = line.pitch_deg * degree,
               r = line.roll_deg * degree;
  // Axes (east, north, down) of a level sonar; then pitched nose up; then rolled starboard down.
  const Vector3d level_forward{std::sin(h), std::cos(h), 0.0};
  const Vector3d level_starboard{std::cos(h), -std::sin(h), 0.0}, level_down{0.0, 0.0, 1.0};
  const Vector3d pitched_down = std::cos(p) * level_down + std::sin(p) * level_forward;
  const Vector3d outward =
      (line.starboard ? 1.0 : -1.0) * (std::cos(r) * level_starboard + std::sin(r) * pitched_down);
  const Vector3d down = std::cos(r) * pitched_down - std::sin(r) * level_starboard;
  // Between abeam and straight down, one direction reaches this depth at this range.
  const double steepest = std::atan2(down.z(), outward.z());
  const double depression =
      steepest - std::acos(std::min(1.0, below_m / range_m / std::hypot(down.z(), outward.z())));
  const Vector3d way = std::cos(depression) * outward + std::sin(depression) * down;
  return line.place_deg +
         (range_m * way.head<2>()).cwiseQuotient(metres_a_degree(line.place_deg.y()));
}

/// The ball's position, averaged over all lines that see it (at least one).
Place place_of_ball_deg(const std::vector<Line>& lines) {
  int brightest = 0;
  for (const Line& line : lines)
    brightest = std::max(brightest, std::ranges::max(line.near_to_far));
  Place sum_deg = Place::Zero();
  int seen = 0;
  for (const Line& line : lines) {
    const auto peak = std::ranges::max_element(line.near_to_far);
    if (*peak < 0.8 * brightest) continue;
    // The brightest point of the ball is the nearest one; the middle is one radius farther.
    const double sample = static_cast<double>(peak - line.near_to_far.begin()) + 0.5;
    sum_deg += place_abeam_deg(line, sample * line.sample_m + radius_m, line.altitude_m - radius_m);
    ++seen;
  }
  REQUIRE(seen > 0);
  return sum_deg / seen;
}

/// The rows of a CSV after its header.
std::vector<std::vector<std::string>> csv_rows(const std::string& csv) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(csv);
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line)) {
    std::istringstream fields(line + ',');
    std::vector<std::string>& row = rows.emplace_back();
    for (std::string field; std::getline(fields, field, ',');) row.push_back(field);
  }
  return rows;
}

/// Runs the level bed with the ball, with additional keys.
void run_with_ball(const TemporaryFolder& folder, const std::string& track_and_sonars,
                   std::string scene = bed_with_ball) {
  scene += track_and_sonars;
  const std::string place =
      fmt::format("[[objects]]\neast_m = {}\nnorth_m = {}\n", ball_m.x(), ball_m.y());
  scene.replace(scene.find("[[objects]]\n"), std::string("[[objects]]\n").size(), place);
  write_text(folder / "scene.toml", scene);
  const Outcome outcome = run_program(folder.path(), {"run", "scene.toml", "-o", "out"});
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
}

}  // namespace

TEST_CASE("A reader of XTF or JSF finds an object at its position for any mounting of the sonar") {
  // Heading 30 degrees; the middle of the track 13 m to port of the ball, or astern of it.
  const std::string to_port =
      "pings = 160\nheading_deg = 30\nmiddle_east_m = -8.26\nmiddle_north_m = 4.5\n";
  const std::string astern =
      "pings = 160\nheading_deg = 30\nmiddle_east_m = -4.5\nmiddle_north_m = -14.99\n";
  const std::string moving = "[motion]\nroll_deg = 6\npitch_deg = -4\ncrab_deg = 5\n";
  struct Case {
    std::string name, track, mounting;
  };
  for (const Case& c : std::vector<Case>{
           {"plain", to_port, ""},
           {"moving", to_port + moving, ""},
           {"lever arm", to_port, "forward_m = 2.5\nstarboard_m = -1\ndown_m = 1\n"},
           {"moving lever arm", to_port + moving, "forward_m = 2\nstarboard_m = 3\ndown_m = 2\n"},
           {"turned about", to_port, "sides = \"port\"\nmount_azimuth_deg = 180\n"},
           {"squinting", to_port + moving, "mount_azimuth_deg = -12\nmount_pitch_deg = 5\n"},
           {"ahead", astern, "sides = \"starboard\"\nmount_azimuth_deg = -90\nforward_m = 0.8\n"},
           {"ahead of the bow", astern,
            "sides = \"starboard\"\nmount_azimuth_deg = -90\nforward_m = 6\ndown_m = 1\n"},
       }) {
    CAPTURE(c.name);
    const TemporaryFolder folder;
    run_with_ball(folder, c.track + "[sonar.s]\n" + c.mounting + sonar);
    const Vector2d by_xtf_m = local_m(place_of_ball_deg(read_xtf(read_text(folder / "out/s.xtf"))));
    const Vector2d by_jsf_m = local_m(place_of_ball_deg(read_jsf(read_text(folder / "out/s.jsf"))));
    CHECK((by_xtf_m - ball_m).norm() < 0.1);  // two bins
    CHECK((by_jsf_m - ball_m).norm() < 0.1);
  }
}

TEST_CASE("A reader finds an object at its position on a map whose north is not true north") {
  struct Map {
    int epsg;
    Vector2d west_south_m;
  };
  // Far east in UTM zone 32, whose north lies there 2.6 degrees to the east; and the equal-area map
  // of Europe, in the English Channel, where its north lies 7.5 degrees to the west.
  const auto [epsg, west_south_m] =
      GENERATE(Map{32632, {749960.0, 5499960.0}}, Map{3035, {3599960.0, 2999960.0}});
  CAPTURE(epsg);
  const TemporaryFolder folder;
  std::string bed = fmt::format("ncols 81\nnrows 81\nxllcorner {}\nyllcorner {}\ncellsize 1\n",
                                west_south_m.x(), west_south_m.y());
  for (int i = 0; i < 81 * 81; ++i) bed += "-20 ";
  write_text(folder / "bed.asc", bed);
  OGRSpatialReference map, wgs84;
  REQUIRE(map.importFromEPSG(epsg) == OGRERR_NONE);
  map.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  REQUIRE(wgs84.importFromEPSG(4326) == OGRERR_NONE);
  wgs84.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  char* wkt = nullptr;
  map.exportToWkt(&wkt);
  write_text(folder / "bed.prj", wkt);
  CPLFree(wkt);
  std::string scene = bed_with_ball;
  const auto replace = [&](const std::string& from, const std::string& to) {
    scene.replace(scene.find(from), from.size(), to);
  };
  replace("extent_east_m = 80\nextent_north_m = 80\ncell_m = 1\ndepth_m = 20\n",
          "kind = \"survey\"\nsurvey = \"bed.asc\"\n");
  replace("[seafloor.fractal]\nheight_at_1m_m = 0\n", "");
  replace("origin_lat_deg = 55\norigin_lon_deg = 10\n", "");
  run_with_ball(folder,
                "pings = 160\nheading_deg = 30\nmiddle_east_m = -8.26\nmiddle_north_m = 4.5\n"
                "[sonar.s]\nforward_m = 2\n" +
                    sonar,
                scene);
  const std::unique_ptr<OGRCoordinateTransformation> to_map(
      OGRCreateCoordinateTransformation(&wgs84, &map));
  for (const std::vector<Line>& lines :
       {read_xtf(read_text(folder / "out/s.xtf")), read_jsf(read_text(folder / "out/s.jsf"))}) {
    Vector2d found = place_of_ball_deg(lines);
    REQUIRE(to_map->Transform(1, &found.x(), &found.y()));
    CHECK((found - west_south_m - Vector2d(40.5, 40.5) - ball_m).norm() < 0.1);
  }
}

TEST_CASE("A recording over a generated seabed lies where its track's latitudes are") {
  const TemporaryFolder folder;
  write_text(folder / "track.csv",
             "t_s,lat_deg,lon_deg\n0,-48.4450,-68.829\n10,-48.4448,-68.829\n");
  std::string scene = bed_with_ball;
  const std::string origin = "origin_lat_deg = 55\norigin_lon_deg = 10\n";
  scene.replace(scene.find(origin), origin.size(), "kind = \"file\"\nfile = \"track.csv\"\n");
  run_with_ball(folder, "[sonar.s]\n" + sonar, scene);
  for (const std::vector<Line>& lines :
       {read_xtf(read_text(folder / "out/s.xtf")), read_jsf(read_text(folder / "out/s.jsf"))}) {
    CHECK((lines.front().place_deg - Place(-68.829, -48.4450)).norm() < 1e-6);
    CHECK((lines.back().place_deg - Place(-68.829, -48.4448)).norm() < 1e-6);
  }
  CHECK(read_text(folder / "out/manifest.json").find("\"reference\": \"PROJCRS") !=
        std::string::npos);
}

TEST_CASE("A recording has the position that the vehicle reports, not the true one") {
  const TemporaryFolder folder;
  run_with_ball(
      folder,
      "pings = 120\nmiddle_east_m = -10\n[navigation]\nposition_bias_m = 4\nheight_bias_m = 1\n"
      "[sonar.s]\nforward_m = 3\nstarboard_m = 1\ndown_m = 2\n" +
          sonar);
  const std::vector<std::string> first = csv_rows(read_text(folder / "out/s_pings.csv")).front();
  const auto column = [&](std::size_t number) { return std::stod(first.at(number)); };
  // x_m, y_m and z_m, three angles, then the same six as reported.
  const Vector2d bias_m{column(8) - column(2), column(9) - column(3)};
  CHECK(bias_m.norm() > 1.0);
  CHECK(std::abs(column(10) - column(4)) > 0.1);
  for (const std::vector<Line>& lines :
       {read_xtf(read_text(folder / "out/s.xtf")), read_jsf(read_text(folder / "out/s.jsf"))}) {
    CHECK((local_m(place_of_ball_deg(lines)) - ball_m - bias_m).norm() < 0.1);
    CHECK(lines.front().depth_m == Approx(2.0 - column(10)).margin(0.001));
    CHECK(lines.front().altitude_m == Approx(8.0).margin(0.001));  // as an altimeter has it
  }
}

TEST_CASE("A reader takes the numbered recordings of a run in parts for one line") {
  const std::string track =
      "pings = 160\nheading_deg = 30\nmiddle_east_m = -8.26\nmiddle_north_m = 4.5\n"
      "[artefacts]\nlost = 0.1\n[sonar.s]\n" +
      sonar;
  const TemporaryFolder whole, in_parts;
  run_with_ball(whole, track);
  std::string scene = bed_with_ball;
  const std::string key = "jsf = true\n";
  scene.replace(scene.find(key), key.size(), key + "pings_per_file = 37\n");
  run_with_ball(in_parts, track, scene);
  using Reader = std::vector<Line> (*)(const std::string&);
  for (const auto& [ending, read] :
       {std::pair<std::string, Reader>{".xtf", &read_xtf}, {".jsf", &read_jsf}}) {
    CAPTURE(ending);
    const std::vector<Line> expected = read(read_text(whole / ("out/s" + ending)));
    std::vector<Line> lines;
    for (const std::string number : {"0001", "0002", "0003", "0004", "0005"}) {
      const std::vector<Line> part =
          read(read_text(in_parts / ("out/part_" + number + "/s_" + number + ending)));
      CHECK(part.size() > 2);
      lines.insert(lines.end(), part.begin(), part.end());
    }
    REQUIRE(lines.size() == expected.size());
    for (std::size_t i = 0; i < lines.size(); ++i) {
      CHECK(lines[i].number == expected[i].number);
      CHECK(lines[i].place_deg == expected[i].place_deg);
      CHECK(lines[i].near_to_far == expected[i].near_to_far);
    }
    CHECK((local_m(place_of_ball_deg(lines)) - ball_m).norm() < 0.1);
  }
}

TEST_CASE("A run's sonars are in one recording, with the samples and positions of their own ones") {
  // Abeam, and ahead of the bow, on a track to port of the ball.
  const std::string track =
      "pings = 160\nheading_deg = 30\nmiddle_east_m = -8.26\nmiddle_north_m = 4.5\n"
      "[artefacts]\nlost = 0.1\n[sonar.a]\nfrequency_hz = 450e3\n" +
      sonar + "[sonar.b]\nforward_m = 2\ndown_m = 1\nfrequency_hz = 400e3\n" + sonar +
      "[sonar.c]\nfrequency_hz = 200e3\n" + sonar;
  const TemporaryFolder apart, together;
  run_with_ball(apart, track);
  std::string scene = bed_with_ball;
  const std::string key = "jsf = true\n";
  scene.replace(scene.find(key), key.size(), key + "one_recording = true\n");
  run_with_ball(together, track, scene);
  CHECK_FALSE(std::filesystem::exists(together / "out/a.xtf"));
  const std::string xtf = read_text(together / "out/recording.xtf");
  const std::string jsf = read_text(together / "out/recording.jsf");
  CHECK(xtf.substr(100, 14) == std::string("recording.xtf\0", 14));  // and the 0 that ends it
  const std::vector<Line> all_xtf = read_xtf(xtf), all_jsf = read_jsf(jsf);
  for (const auto& [name, channels, subsystem] :
       {std::tuple{"a", 0, 22}, std::tuple{"b", 2, 21}, std::tuple{"c", 4, 20}}) {
    CAPTURE(name);
    const auto check = [&](const std::vector<Line>& all, const std::vector<Line>& expected,
                           int first, int last) {
      std::vector<Line> lines;
      std::ranges::copy_if(all, std::back_inserter(lines), [&](const Line& line) {
        return line.source >= first && line.source <= last;
      });
      REQUIRE(lines.size() == expected.size());
      for (std::size_t i = 0; i < lines.size(); ++i) {
        CHECK(lines[i].number == expected[i].number);
        CHECK(lines[i].place_deg == expected[i].place_deg);
        CHECK(lines[i].depth_m == expected[i].depth_m);
        CHECK(lines[i].starboard == expected[i].starboard);
        CHECK(lines[i].near_to_far == expected[i].near_to_far);
      }
      CHECK((local_m(place_of_ball_deg(lines)) - ball_m).norm() < 0.1);
    };
    check(all_xtf, read_xtf(read_text(apart / ("out/" + std::string(name) + ".xtf"))), channels,
          channels + 1);
    check(all_jsf, read_jsf(read_text(apart / ("out/" + std::string(name) + ".jsf"))), subsystem,
          subsystem);
  }
}

TEST_CASE("The JSF subsystems of a scene's sonars are ordered by frequency") {
  const TemporaryFolder folder;
  run_with_ball(folder, "pings = 1\n[sonar.a]\nfrequency_hz = 900e3\n" + sonar +
                            "[sonar.b]\nfrequency_hz = 120e3\n" + sonar +
                            "[sonar.c]\nfrequency_hz = 400e3\n" + sonar);
  for (const auto& [name, subsystem] : {std::pair{"a", 22}, {"b", 20}, {"c", 21}})
    CHECK(int(at<std::uint8_t>(read_text(folder / "out" / (name + std::string(".jsf"))), 7)) ==
          subsystem);
}

TEST_CASE("A lost ping and its number are missing from the recordings") {
  const TemporaryFolder folder;
  run_with_ball(folder, "pings = 40\n[artefacts]\nlost = 0.3\n[sonar.s]\n" + sonar);
  std::vector<std::uint32_t> expected;
  for (const std::vector<std::string>& row : csv_rows(read_text(folder / "out/s_pings.csv")))
    if (row.back() != "lost")
      for (int side = 0; side < 2; ++side)
        expected.push_back(static_cast<std::uint32_t>(std::stoul(row.front())));
  CHECK(expected.size() < 70);
  CHECK(expected.size() > 40);
  for (const std::vector<Line>& lines :
       {read_xtf(read_text(folder / "out/s.xtf")), read_jsf(read_text(folder / "out/s.jsf"))}) {
    std::vector<std::uint32_t> numbers;
    for (const Line& line : lines) numbers.push_back(line.number);
    CHECK(numbers == expected);
  }
}

TEST_CASE("If all pings of a run are lost, its recordings have no pings") {
  const TemporaryFolder folder;
  run_with_ball(folder, "pings = 3\n[artefacts]\nlost = 1\n[sonar.s]\n" + sonar);
  CHECK(read_text(folder / "out/s.xtf").size() == 1024);
  CHECK(read_text(folder / "out/s.jsf").empty());
}
