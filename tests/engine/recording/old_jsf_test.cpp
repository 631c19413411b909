// JSF files as EdgeTech wrote them before 2008: without validity flags, with signed headings and
// the time as a calendar's.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/recording/recording_bytes.h"
#include "support/catch.h"
#include "support/small_recording.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/output/jsf.h>
#include <ensonify/engine/recording/recording_reader.h>

using namespace ensonify;
using namespace ensonify::engine;
using ensonify::tests::put;

namespace {

/// The line of a JSF whose sonar headers are altered, by the number of the message.
RecordedLine altered(
    const std::function<void(std::span<std::byte> header, std::size_t message)>& alter) {
  const Recording written = tests::small_recording();
  std::vector<std::byte> bytes = encode_jsf({&written, 1});
  const std::size_t message = bytes.size() / 6;
  for (std::size_t i = 0; i < 6; ++i)
    alter(std::span(bytes).subspan(i * message + jsf_message_header, jsf_sonar_header), i);
  return parse_recording(bytes, "r").front();
}

void clear_flags(std::span<std::byte> header) { put<std::uint16_t>(header, 30, 0); }

}  // namespace

TEST_CASE("the navigation of a JSF without validity flags is read, with a warning") {
  const RecordedLine sound = altered([](auto, auto) {});
  CHECK(sound.warnings.empty());
  const RecordedLine line = altered([](auto header, auto) { clear_flags(header); });
  REQUIRE(line.pings.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    const RecordedPing &ping = line.pings[i], &same = sound.pings[i];
    CHECK(ping.place.value() == same.place.value());
    CHECK(ping.heading_rad.value() == same.heading_rad.value());
    CHECK(ping.pitch_rad.value() == same.pitch_rad.value());
    CHECK(ping.roll_rad.value() == same.roll_rad.value());
    CHECK(ping.depth_m.value() == same.depth_m.value());
    CHECK(ping.altitude_m.value() == same.altitude_m.value());
    CHECK(ping.speed_mps.value() == same.speed_mps.value());
  }
  REQUIRE(line.warnings.size() == 1);
  CHECK_THAT(line.warnings[0],
             Catch::StartsWith("r: its pings ") && Catch::Contains("valid") &&
                 Catch::EndsWith(": place, heading, pitch, roll, depth, altitude, speed"));
}

TEST_CASE("values of a JSF without validity flags that no sonar has are not read") {
  const RecordedLine line = altered([](auto header, auto) {
    clear_flags(header);
    put<std::int32_t>(header, 80, 0);
    put<std::int32_t>(header, 84, 0);
    put<std::int32_t>(header, 136, -1);
    put<std::int32_t>(header, 144, 2'000'000'000);
    put<std::int16_t>(header, 174, -32768);  // -180 degrees of pitch
    put<std::int16_t>(header, 194, 32767);   // tenths of a knot
  });
  const RecordedPing& ping = line.pings.front();
  CHECK_FALSE(ping.place);
  CHECK_FALSE(ping.depth_m);
  CHECK_FALSE(ping.altitude_m);
  CHECK_FALSE(ping.pitch_rad);
  CHECK_FALSE(ping.roll_rad);
  CHECK_FALSE(ping.speed_mps);
  CHECK(ping.heading_rad);
  REQUIRE(line.warnings.size() == 1);
  CHECK(line.warnings.front().ends_with("read where it is plausible: heading"));
  // All zeros are fields that are not used.
  const RecordedLine empty = altered([](auto header, auto) {
    clear_flags(header);
    std::ranges::fill(header.subspan(80, 8), std::byte{0});
    std::ranges::fill(header.subspan(136, 4), std::byte{0});
    std::ranges::fill(header.subspan(144, 4), std::byte{0});
    std::ranges::fill(header.subspan(172, 6), std::byte{0});
    std::ranges::fill(header.subspan(194, 2), std::byte{0});
    std::ranges::fill(header.subspan(20, 2), std::byte{0});
  });
  CHECK_FALSE(empty.pings.front().heading_rad);
  CHECK_FALSE(empty.pings.front().roll_rad);
  CHECK(empty.warnings.empty());
}

TEST_CASE("validity flags in any ping of a JSF hold for all of them") {
  const RecordedLine line = altered([](auto header, std::size_t message) {
    if (message > 1) clear_flags(header);
  });
  CHECK(line.pings[0].place);
  CHECK_FALSE(line.pings[1].place);
  CHECK_FALSE(line.pings[2].heading_rad);
  CHECK(line.warnings.empty());
}

TEST_CASE("a JSF without seconds since 1970 has the time of its calendar") {
  const RecordedLine sound = altered([](auto, auto) {});
  for (const bool has_milliseconds : {true, false}) {
    const RecordedLine line = altered([&](auto header, auto) {
      put<std::int32_t>(header, 0, 0);
      if (!has_milliseconds) put<std::uint32_t>(header, 200, 0);
    });
    for (std::size_t i = 0; i < 3; ++i)
      CHECK(line.pings[i].t_s.value() == Approx(has_milliseconds
                                                    ? sound.pings[i].t_s.value()
                                                    : std::floor(sound.pings[i].t_s.value()))
                                             .epsilon(0)
                                             .margin(1e-6));
  }
  for (const auto& [year, day] : {std::pair{0, 60}, {2024, 0}, {2024, 367}}) {
    const RecordedLine line = altered([year = year, day = day](auto header, auto) {
      put<std::int32_t>(header, 0, 0);
      put(header, 156, static_cast<std::int16_t>(year));
      put(header, 158, static_cast<std::int16_t>(day));
    });
    CHECK_FALSE(line.pings.front().t_s);
  }
}

TEST_CASE("headings of a JSF are from -180 to 360 degrees, and others are impossible") {
  const auto with_heading = [](int hundredths) {
    return altered(
        [&](auto header, auto) { put(header, 172, static_cast<std::uint16_t>(hundredths)); });
  };
  for (const int heading_deg : {-180, -90, -1, 0, 90, 181, 360}) {
    CAPTURE(heading_deg);
    const RecordedLine line = with_heading(100 * heading_deg);
    CHECK(line.pings[1].heading_rad.value() == Approx(heading_deg * degree).margin(1e-9));
    CHECK(line.warnings.empty());
  }
  for (const int hundredths : {36001, 65536 - 18001}) {
    const RecordedLine line = with_heading(hundredths);
    CHECK_FALSE(line.pings[1].heading_rad);
    REQUIRE(line.warnings.size() == 1);
    CHECK_THAT(
        line.warnings.front(),
        Catch::StartsWith("r: 3 pings state an impossible heading; it is left out; the first "
                          "is ping 7, with "));
  }
}

TEST_CASE("a latitude of a JSF that Earth does not have is named") {
  const RecordedLine line = altered([](auto header, std::size_t message) {
    if (message > 1) put<std::int32_t>(header, 84, 129 * 600'000);
  });
  CHECK(line.pings[0].place);
  CHECK_FALSE(line.pings[1].place);
  REQUIRE(line.warnings.size() == 1);
  CHECK_THAT(line.warnings[0],
             Catch::StartsWith("r: 2 pings state an impossible latitude or longitude;") &&
                 Catch::EndsWith("ping 9, with latitude 129, longitude -10.5"));
}

TEST_CASE("places of a JSF that only its NMEA messages have are not lost in silence") {
  Recording written = tests::small_recording();
  for (const bool has_places : {true, false}) {
    std::vector<std::byte> bytes = encode_jsf({&written, 1});
    const std::size_t message = bytes.size() / 6;
    for (std::size_t i = 0; i < 6; ++i)
      if (!has_places) put<std::uint16_t>(std::span(bytes).subspan(i * message), 16 + 30, 0x662C);
    put<std::uint16_t>(std::span(bytes).subspan(4 * message), 4, 2002);
    const std::vector<std::string> warnings = parse_recording(bytes, "r").front().warnings;
    if (has_places)
      CHECK(warnings.empty());
    else
      CHECK(warnings == std::vector<std::string>{
                            "r: its pings have no places; places in messages of type 2002, "
                            "NMEA (1) are not read"});
  }
}

TEST_CASE("a JSF without a sidescan is named by what it has") {
  const Recording written = tests::small_recording();
  std::vector<std::byte> bytes = encode_jsf({&written, 1});
  const std::size_t message = bytes.size() / 6;
  const auto error_with = [&](int first, int type, int subsystem) {
    for (std::size_t i = static_cast<std::size_t>(first); i < 6; ++i) {
      put(std::span(bytes).subspan(i * message), 4, static_cast<std::uint16_t>(type));
      put(std::span(bytes).subspan(i * message), 7, static_cast<std::uint8_t>(subsystem));
    }
    return tests::error_of(bytes);
  };
  CHECK(error_with(0, 80, 0) ==
        "r: has no sidescan samples; it has messages of a sub-bottom profiler, subsystem 0 (6), "
        "expected a recording of a sidescan sonar");
  CHECK(error_with(2, 3000, 40) ==
        "r: has no sidescan samples; it has messages of a sub-bottom profiler, subsystem 0 (2) and "
        "messages of type 3000 (4), expected a recording of a sidescan sonar");
  CHECK_THAT(error_with(0, 80, 41),
             Catch::Contains("it has messages of bathymetry, subsystem 41 (6), expected"));
}
