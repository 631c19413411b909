// The path of a vehicle: from a line's samples and its navigation.

#include <cmath>
#include <numbers>
#include <vector>

#include "support/catch.h"

#include "made_line.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/imitation/vehicle_path.h>
#include <ensonify/engine/recording/recording_reader.h>

using namespace ensonify;
using namespace ensonify::engine;
using tests::made_line;
using tests::range_m;
using tests::samples;
using tests::varied_m;

TEST_CASE("the bottom line and the navigation give the vehicle's path") {
  RecordedLine line = made_line({.altitude_m = &varied_m});
  // Something hangs in the water on one side, and some pings have no place.
  for (std::size_t ping = 100; ping < 130; ++ping) {
    line.pings[ping].place.reset();
    for (std::size_t k = 20; k < 40; ++k) line.port[ping * samples + k] = 20000.0f;
  }
  const VehiclePath path = vehicle_path(LineWithBed(line));
  REQUIRE(path.altitude_m.size() == 320);
  for (std::size_t ping = 0; ping < 320; ++ping) {
    CAPTURE(ping);
    CHECK(std::abs(path.altitude_m[ping] - varied_m(ping)) < 0.5);
  }
  CHECK(path.bed_depth_m == Approx(20.0).margin(0.1));
  CHECK(path.depth.how == Confidence::stated);
  CHECK(path.ping_interval_s == Approx(0.1).epsilon(1e-3));
  for (const double interval_s : {0.01477, 0.0151, 0.02685, 0.034}) {
    RecordedLine rounded = line;  // as an XTF has times, with a pause
    for (std::size_t ping = 0; ping < rounded.pings.size(); ++ping)
      rounded.pings[ping].t_s =
          std::floor(100.0 * interval_s * double(ping) + (ping < 200 ? 0.0 : 3000.0)) / 100.0;
    CHECK(vehicle_path(LineWithBed(rounded)).ping_interval_s == Approx(interval_s).epsilon(0.01));
  }
  // 3e-8 rad of latitude at 55 degrees: the meridian's radius of curvature is 6378 km (WGS 84).
  CHECK(path.speed_mps == Approx(10.0 * 3e-8 * 6378.2e3).epsilon(2e-3));
  CHECK(path.origin.value().latitude_rad ==
        Approx(55.0 * degree + 3e-8 * 159.5).epsilon(0).margin(1e-9));
  CHECK(path.roll_rad.empty());
  CHECK(path.attitude.how == Confidence::assumed);

  for (RecordedPing& ping : line.pings) {
    ping.place.reset();
    ping.t_s.reset();
    ping.depth_m.reset();
    ping.pitch_rad = 20.0 * degree * (ping.number % 2 == 0 ? 1.0 : 0.9999);
  }
  const VehiclePath bare = vehicle_path(LineWithBed(line));
  CHECK(bare.place.how == Confidence::assumed);
  CHECK(bare.time.how == Confidence::assumed);
  CHECK(bare.depth.how == Confidence::assumed);
  CHECK(bare.ping_interval_s == Approx(2.0 * range_m / 1500.0));
  CHECK_FALSE(bare.origin);
  // A pitched sonar's first return comes from ahead.
  CHECK(bare.altitude_m[10] == Approx(path.altitude_m[10] * std::cos(20.0 * degree)).epsilon(1e-3));
}

TEST_CASE("an altitude that changes fast at the ends of a line is followed to the ends") {
  const auto altitude_m = [](std::size_t ping) {
    const auto from_end = static_cast<double>(std::min<std::size_t>(ping, 319 - ping));
    return 4.0 + std::max(0.0, 4.0 - 0.13 * from_end);
  };
  const VehiclePath path = vehicle_path(LineWithBed(made_line({.altitude_m = altitude_m})));
  for (std::size_t ping = 0; ping < 320; ++ping) {
    CAPTURE(ping);
    CHECK(std::abs(path.altitude_m[ping] - altitude_m(ping)) < 0.4);
  }
}

TEST_CASE("wrong fixes neither turn nor move a path") {
  const RecordedLine line = made_line({});
  const VehiclePath whole = vehicle_path(LineWithBed(line));
  // Wrong places: one at the begin, and more neighbours than a median over the pings around can
  // leave out. The last one is on the other side of the Earth.
  RecordedLine wrong = line;
  wrong.pings[0].place = GeographicPlace{1.0 * degree, 1.0 * degree};
  for (std::size_t ping = 100; ping < 140; ++ping)
    wrong.pings[ping].place = GeographicPlace{55.0 * degree, -10.0 * degree};
  wrong.pings[319].place = GeographicPlace{-20.0 * degree, -170.0 * degree};
  const VehiclePath path = vehicle_path(LineWithBed(wrong));
  CHECK(path.origin.value().latitude_rad ==
        Approx(whole.origin.value().latitude_rad).epsilon(0).margin(1e-7));
  CHECK(path.origin.value().longitude_rad ==
        Approx(whole.origin.value().longitude_rad).epsilon(0).margin(1e-7));
  for (std::size_t ping = 0; ping < 320; ++ping) {
    CAPTURE(ping);
    CHECK(std::hypot(path.x_m[ping] - whole.x_m[ping], path.y_m[ping] - whole.y_m[ping]) < 0.5);
  }
}

TEST_CASE("a roll or a pitch that no sonar has is unknown") {
  RecordedLine line = made_line({});
  for (RecordedPing& ping : line.pings) {
    ping.roll_rad = 3.0 * degree;
    ping.pitch_rad = -2.0 * degree;
  }
  line.pings[50].pitch_rad = 150.0 * degree;
  line.pings[60].roll_rad = -170.0 * degree;
  const VehiclePath path = vehicle_path(LineWithBed(line));
  CHECK(path.pitch_rad == std::vector<double>(320, -2.0 * degree));
  CHECK(path.roll_rad == std::vector<double>(320, 3.0 * degree));
}

TEST_CASE("a wrong pitch or stated altitude of single pings moves no altitude") {
  RecordedLine line = made_line({});
  for (RecordedPing& ping : line.pings) ping.pitch_rad = 1.0 * degree;
  line.pings[50].pitch_rad = line.pings[120].pitch_rad = -50.0 * degree;
  line.pings[121].pitch_rad = 55.0 * degree;
  const VehiclePath path = vehicle_path(LineWithBed(line));
  CHECK(path.pitch_rad == std::vector<double>(320, 1.0 * degree));
  for (const double altitude_m : path.altitude_m) CHECK(altitude_m == Approx(8.0).margin(0.3));
  // Without a bottom line the stated altitudes count.
  std::ranges::fill(line.port, 0.0f);
  std::ranges::fill(line.starboard, 0.0f);
  for (RecordedPing& ping : line.pings) ping.altitude_m = 8.0;
  line.pings[70].altitude_m = 0.5;
  line.pings[200].altitude_m = 45.0;
  CHECK(vehicle_path(LineWithBed(line)).altitude_m == std::vector<double>(320, 8.0));
}

TEST_CASE("a line without a bottom line is refused") {
  RecordedLine line = made_line({});
  std::ranges::fill(line.port, 100.0f);
  std::ranges::fill(line.starboard, 100.0f);
  CHECK_THROWS_AS(vehicle_path(LineWithBed(line)), RecordingError);
}

TEST_CASE("water that is hardly darker than the bed shows no bottom line, however short the line") {
  // The gain makes far ranges brighter, so that the ranges are not even.
  const auto line = [](double column_db, std::size_t pings) {
    return made_line({.pings = pings,
                      .spreading = 36.0,
                      .level = 0.05,
                      .column = 0.05 * std::pow(10.0, column_db / 20.0)});
  };
  for (const std::size_t pings : {64u, 320u}) {
    CAPTURE(pings);
    RecordedLine faint = line(-1.0, pings);
    CHECK_THROWS_WITH(vehicle_path(LineWithBed(faint)),
                      Catch::Contains("dB darker than the bed behind it"));
    for (RecordedPing& ping : faint.pings) ping.altitude_m = 8.0;
    const VehiclePath stated = vehicle_path(LineWithBed(faint));
    CHECK(stated.altitude.how == Confidence::stated);
    CHECK(std::ranges::max(stated.altitude_m) == 8.0);
    CHECK(std::ranges::min(stated.altitude_m) == 8.0);
    const VehiclePath shown = vehicle_path(LineWithBed(line(-8.0, pings)));
    CHECK(shown.altitude.how == Confidence::measured);
    CHECK(shown.altitude_m[pings / 2] == Approx(8.0).margin(0.4));
  }
}

TEST_CASE("a dark part of the bed behind bright water is no water column") {
  RecordedLine line = made_line({.column = 0.09});  // 1 dB darker than the bed
  for (std::vector<float>* side : {&line.port, &line.starboard})
    for (std::size_t i = 0; i < side->size(); ++i)  // as where the beam receives weakly
      if (i % samples > 80 && i % samples < 105) (*side)[i] *= 0.5f;
  CHECK_THROWS_WITH(vehicle_path(LineWithBed(line)),
                    Catch::Contains("dB darker than the bed behind it"));
  for (RecordedPing& ping : line.pings) ping.altitude_m = 8.0;
  CHECK(std::ranges::max(vehicle_path(LineWithBed(line)).altitude_m) == 8.0);
}

TEST_CASE("an oscillation has the rms and the period that were put in, whatever the turns") {
  std::vector<double> values;
  for (int i = 0; i < 3000; ++i) {
    const double t = 0.1 * i;
    values.push_back(3.0 + 0.01 * t + 0.5 * std::sin(2.0 * std::numbers::pi * t / 4.0) +
                     2.0 * std::sin(2.0 * std::numbers::pi * t / 100.0) + (i < 1500 ? 0.0 : 3.0));
  }
  const Oscillation found = oscillation_of(0.1, values);
  CHECK(found.rms == Approx(0.5 / std::numbers::sqrt2).epsilon(0.15));
  CHECK(found.period_s == Approx(4.0).epsilon(0.05));
}

TEST_CASE("pauses and set clocks change neither the ping interval nor the speed") {
  const RecordedLine line = made_line({});
  const auto with_times = [&](auto&& time_of) {
    RecordedLine other = line;
    for (std::size_t ping = 0; ping < other.pings.size(); ++ping)
      other.pings[ping].t_s = 1e9 + time_of(ping);
    return vehicle_path(LineWithBed(other));
  };
  const double speed_mps = vehicle_path(LineWithBed(line)).speed_mps;
  REQUIRE(speed_mps > 1.0);
  for (const double jump_s : {3600.0, -3600.0, -20.0, -0.5}) {
    CAPTURE(jump_s);
    const VehiclePath path = with_times(
        [&](std::size_t ping) { return 0.1 * double(ping) + (ping < 150 ? 0.0 : jump_s); });
    CHECK(path.ping_interval_s == Approx(0.1));
    CHECK(path.speed_mps == Approx(speed_mps).epsilon(0.02));
    CHECK(path.time.how == (jump_s > 0.0 ? Confidence::stated : Confidence::measured));
    CHECK(std::ranges::is_sorted(path.t_s));
  }
  // Neighbours in the wrong order, and whole seconds.
  CHECK(with_times([](std::size_t ping) { return 0.1 * double(ping ^ 1u); }).ping_interval_s ==
        Approx(0.1).epsilon(0.01));
  CHECK(with_times([](std::size_t ping) {
          return std::floor(0.1 * double(ping));
        }).ping_interval_s == Approx(0.1).epsilon(0.04));
  const VehiclePath still = with_times([](std::size_t) { return 5.0; });
  CHECK(still.time.how == Confidence::assumed);
  CHECK(still.ping_interval_s == Approx(2.0 * range_m / 1500.0));
}

TEST_CASE("rows of several beams are known by their beam or by their time") {
  RecordedLine line = made_line({});
  CHECK_FALSE(has_several_beams(line));
  for (RecordedPing& ping : line.pings) {
    const std::uint64_t pair = ping.number / 2;
    ping.t_s = 1e9 + 0.1 * static_cast<double>(pair);
  }
  CHECK(has_several_beams(line));
  // A clock of whole seconds.
  for (RecordedPing& ping : line.pings) {
    const std::uint64_t second = ping.number / 10;
    ping.t_s = 1e9 + static_cast<double>(second);
  }
  CHECK_FALSE(has_several_beams(line));
  line.pings[3].beam = 1;
  CHECK(has_several_beams(line));
}

TEST_CASE("headings that no vehicle has on its course are left out, and a crab stays") {
  for (const double off_deg : {40.0, 90.0, 180.0, 270.0}) {
    CAPTURE(off_deg);
    RecordedLine line = made_line({});  // its course is north
    for (RecordedPing& ping : line.pings) ping.heading_rad = off_deg * degree;
    const VehiclePath path = vehicle_path(LineWithBed(line));
    const bool crabs = off_deg == 40.0;
    CHECK(path.heading_rad.empty() != crabs);
    CHECK(path.heading_instead.empty() == crabs);
    CHECK(heading_rad(path, 100) == Approx(crabs ? off_deg * degree : 0.0).margin(1e-6));
  }
}

TEST_CASE("a heading of 0 in every ping gives way to the ship's gyro, as in a track") {
  RecordedLine line = made_line({});
  for (std::size_t i = 0; i < line.pings.size(); ++i) {  // to the east
    line.pings[i].place = GeographicPlace{55.0 * degree, 10.0 * degree + 5e-8 * double(i)};
    line.pings[i].heading_rad = 0.0;
    line.pings[i].gyro_rad = 95.0 * degree;
  }
  VehiclePath path = vehicle_path(LineWithBed(line));
  CHECK(heading_rad(path, 100) == Approx(95.0 * degree));
  CHECK_THAT(path.attitude.why,
             Catch::StartsWith("the ship's heading of the pings; the heading is 0"));
  for (RecordedPing& ping : line.pings) ping.gyro_rad.reset();
  path = vehicle_path(LineWithBed(line));
  CHECK(path.heading_rad.empty());
  CHECK(heading_rad(path, 100) == Approx(90.0 * degree).margin(1e-3));
}

TEST_CASE("a vehicle without positions goes along its headings, and the reason is named") {
  RecordedLine line = made_line({});
  for (std::size_t i = 0; i < line.pings.size(); ++i) {
    RecordedPing& ping = line.pings[i];
    ping.heading_rad = 60.0 * degree;
    ping.speed_mps = 2.0;
    if (i >= 100) ping.place.reset();
  }
  VehiclePath path = vehicle_path(LineWithBed(line));
  CHECK(path.place.how == Confidence::assumed);
  CHECK(path.place.why ==
        "only 100 of 320 pings have a position: along the headings at 2.00 m/s, the stated speed");
  CHECK(course_rad(path, 100) == Approx(60.0 * degree));
  CHECK(path.speed_mps == Approx(2.0));
  for (RecordedPing& ping : line.pings) ping.place = GeographicPlace{55.0 * degree, 0.0};
  path = vehicle_path(LineWithBed(line));
  CHECK(path.place.why.starts_with("all positions are the same: "));
  line = made_line({});
  for (RecordedPing& ping : line.pings) ping.place.reset();
  path = vehicle_path(LineWithBed(line));
  CHECK(path.place.why == "no positions: straight north at 1.50 m/s, a usual speed");
}

TEST_CASE("positions that some pings lack are interpolated, and counted") {
  RecordedLine line = made_line({});
  for (std::size_t i = 100; i < 220; ++i) line.pings[i].place.reset();
  const VehiclePath path = vehicle_path(LineWithBed(line)),
                    whole = vehicle_path(LineWithBed(made_line({})));
  CHECK(path.place.why == "positions of 200 of 320 pings, interpolated, smoothed over 3 s");
  for (std::size_t i = 0; i < 320; ++i) CHECK(std::abs(path.y_m[i] - whole.y_m[i]) < 0.05);
}
