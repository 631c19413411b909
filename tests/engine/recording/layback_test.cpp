// Finds the place of a towed sonar from a file that has the ship's places.

#include <cmath>
#include <vector>

#include "support/altered_xtf.h"
#include "support/catch.h"
#include "support/small_recording.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/seafloor/bed/geographic.h>

using namespace ensonify;
using namespace ensonify::engine;
using tests::AlteredXtf;

namespace {

constexpr std::size_t towed_pings = 200;
const GeographicPlace middle{55.0 * degree, -10.5 * degree};

/// Where a ship is that goes 400 m east and then 400 m north, 4 m from ping to ping.
Eigen::Vector2d ship_m(double ping) {
  return {4.0 * std::min(ping, 100.0), 4.0 * std::max(ping - 100.0, 0.0)};
}

/// A recording whose headers have the ship's places, and the sonar's places if `with_sonar`.
AlteredXtf towed(float layback_m, std::uint16_t cable_m, bool with_sonar) {
  Recording recording = tests::small_recording();
  const NavPing first = recording.pings.front();
  recording.pings.clear();
  recording.samples.clear();
  for (std::size_t i = 0; i < towed_pings; ++i) {
    NavPing ping = first;
    ping.row = ping.number = i;
    ping.unix_ms += static_cast<std::int64_t>(250 * i);
    ping.depth_m = 30.0;
    recording.pings.push_back(ping);
    for (std::size_t k = 0; k < 10; ++k)
      recording.samples.push_back(static_cast<std::uint16_t>(i + k + 1));
  }
  recording.gain_db.resize(towed_pings);
  AlteredXtf file(recording);
  for (std::size_t i = 0; i < towed_pings; ++i) {
    const GeographicPlace ship = place_of_tangent(ship_m(static_cast<double>(i)), middle).where;
    std::vector<std::byte>& packet = file.packets[i];
    for (const std::size_t at : {std::size_t{128}, std::size_t{160}}) {
      const bool unset = at == 160 && !with_sonar;
      AlteredXtf::put(packet, at, unset ? 0.0 : ship.latitude_rad / degree);
      AlteredXtf::put(packet, at + 8, unset ? 0.0 : ship.longitude_rad / degree);
    }
    AlteredXtf::put(packet, 182, cable_m);
    AlteredXtf::put(packet, 184, layback_m);
  }
  return file;
}

double off_m(const RecordedPing& ping, const Eigen::Vector2d& place_m) {
  return (tangent_place(ping.place.value(), middle).place - place_m).norm();
}

}  // namespace

TEST_CASE("a towed sonar is where its ship was, as far back as the layback") {
  for (const bool with_sonar : {false, true}) {  // which is also the ship's
    const RecordedLine line = towed(100.0f, 0, with_sonar).line();
    REQUIRE(line.pings.size() == towed_pings);
    CHECK(off_m(line.pings[0], {-100.0, 0.0}) < 0.05);  // it came straight from behind
    CHECK(off_m(line.pings[60], ship_m(35)) < 0.05);
    CHECK(off_m(line.pings[180], ship_m(155)) < 0.05);
    // Behind the turn: 60 m north of it, and 80 m before it, the ship was 100 m away.
    CHECK(off_m(line.pings[115], {320.0, 0.0}) < 0.1);
    CHECK(line.pings[60].layback_m == 100.0);
    REQUIRE(line.warnings.size() == 1);
    CHECK_THAT(line.warnings[0], Catch::Contains("places are those of the ship") &&
                                     Catch::Contains("by 100.0 m on average"));
  }
}

TEST_CASE("without a layback, a cable is straight from the ship to the depth of the sonar") {
  // 40 m back and 30 m down for 50 m of cable.
  const RecordedLine line = towed(0.0f, 50, false).line();
  CHECK(off_m(line.pings[60], ship_m(50)) < 0.05);
}

TEST_CASE("a place of the sonar itself is not moved, and neither is one without a layback") {
  AlteredXtf file = towed(100.0f, 120, true);
  for (std::size_t i = 0; i < towed_pings; ++i) {
    const GeographicPlace sonar =
        place_of_tangent(ship_m(static_cast<double>(i)) - Eigen::Vector2d(70.0, 5.0), middle).where;
    AlteredXtf::put(file.packets[i], 160, sonar.latitude_rad / degree);
    AlteredXtf::put(file.packets[i], 168, sonar.longitude_rad / degree);
  }
  RecordedLine line = file.line();
  CHECK(off_m(line.pings[60], ship_m(60) - Eigen::Vector2d(70.0, 5.0)) < 0.01);
  CHECK_FALSE(line.pings[60].layback_m);
  CHECK(line.warnings.empty());
  line = towed(0.0f, 0, false).line();
  CHECK(off_m(line.pings[60], ship_m(60)) < 0.01);
  CHECK(line.warnings.empty());
}

TEST_CASE("a ship that does not move has no track to tow along") {
  AlteredXtf file = towed(100.0f, 0, false);
  for (std::vector<std::byte>& packet : file.packets) {
    AlteredXtf::put(packet, 128, 55.0);
    AlteredXtf::put(packet, 136, -10.5);
  }
  const RecordedLine line = file.line();
  CHECK(off_m(line.pings[60], {0.0, 0.0}) < 0.01);
  CHECK_FALSE(line.pings[60].layback_m);
  REQUIRE(line.warnings.size() == 1);
  CHECK_THAT(line.warnings[0], Catch::Contains("the ship does not move; its place is used"));
}

TEST_CASE("a ping whose place is neither degrees nor metres has no place and no layback") {
  AlteredXtf file = towed(100.0f, 0, false);
  AlteredXtf::put(file.packets[60], 128, 500.0);
  const RecordedLine line = file.line();
  CHECK_FALSE(line.pings[60].place);
  CHECK_FALSE(line.pings[60].place_m);
  CHECK_FALSE(line.pings[60].layback_m);
  CHECK(line.pings[61].layback_m == 100.0);
}

TEST_CASE("a place in metres that no map reaches does not count, and moves no other place") {
  AlteredXtf file = towed(100.0f, 0, false);
  AlteredXtf::put(file.head, 164, std::uint16_t{0});  // metres
  for (std::size_t i = 0; i < towed_pings; ++i) {
    AlteredXtf::put(file.packets[i], 128, 6.2e6 + ship_m(static_cast<double>(i)).y());
    AlteredXtf::put(file.packets[i], 136, 4e5 + ship_m(static_cast<double>(i)).x());
  }
  AlteredXtf::put(file.packets[50], 128, 1e300);
  const RecordedLine line = file.line();
  CHECK_FALSE(line.pings[50].place_m);
  CHECK((line.pings[90].place_m.value() - Eigen::Vector2d(4e5 + 260.0, 6.2e6)).norm() < 0.01);
}
