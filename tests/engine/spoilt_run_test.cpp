// Lost and repeated pings and stale navigation through all pings of a scene.

#include <ensonify/engine/simulator/ping_all.h>

#include <algorithm>
#include <vector>

#include "support/catch.h"
#include "support/tiny_scene.h"

#include <ensonify/engine/scene/reader.h>

using namespace ensonify::engine;

namespace {

/// A scene with blocks of 4 pings: a repeated ping lies in another block than the ping it repeats.
Scene spoilt_scene() {
  Scene scene = parse_scene(ensonify::tests::tiny_scene, "tiny", {}, {});
  scene.track.pings = 61;
  scene.track.speed_mps = 1.0;
  scene.artefacts = {.lost = 0.2, .repeated = 0.3, .stale_navigation = 0.4, .stale_s = 0.1};
  return scene;
}

bool same_pose(const Pose& a, const Pose& b) {
  return a.position == b.position && a.roll_rad == b.roll_rad && a.pitch_rad == b.pitch_rad &&
         a.heading_rad == b.heading_rad;
}

/// All layers of a row as numbers.
std::vector<double> row_of(const Waterfall& image, std::size_t row) {
  std::vector<double> all;
  BinLayers::for_each([&](std::string_view, auto layer) {
    const auto from =
        (image.pixels.*layer).begin() + static_cast<std::ptrdiff_t>(row * image.columns());
    all.insert(all.end(), from, from + static_cast<std::ptrdiff_t>(image.columns()));
  });
  return all;
}

}  // namespace

TEST_CASE(
    "lost and repeated pings of a run are recorded as such, and the other rows do not change") {
  Scene scene = spoilt_scene();
  SECTION("the first ping is recorded") {}
  SECTION("the first ping is lost, and the second has nothing to repeat, but the third has") {
    const auto wanted = [&] {
      const auto lost = [&](std::size_t ping) {
        return is_lost(scene.artefacts, scene.seed, ping);
      };
      return lost(0) && !lost(1) && !lost(2) && is_repeated(scene.artefacts, scene.seed, 1) &&
             is_repeated(scene.artefacts, scene.seed, 2);
    };
    while (!wanted()) ++scene.seed;
  }
  Simulator simulator(scene);
  const ScenePings all = ping_all(scene, simulator, 1);
  const Waterfall& image = all.images.front();
  Scene clean = scene;
  clean.artefacts = {};
  Simulator other(clean);
  const ScenePings unspoilt = ping_all(clean, other, 1);
  const Waterfall& whole = unspoilt.images.front();

  int lost = 0, repeated = 0, repeated_after_lost = 0, kept = 0;
  std::size_t recorded = 0;  // the last recorded ping
  bool any_yet = false;
  for (std::size_t ping = 0; ping < image.rows(); ++ping) {
    CAPTURE(ping);
    const Artefacts said = image.pings[ping].artefacts;
    REQUIRE(said.has(Artefact::lost) == is_lost(scene.artefacts, scene.seed, ping));
    REQUIRE(image.pings[ping].recorded == !said.has(Artefact::lost));
    const std::vector<double> row = row_of(image, ping);
    if (said.has(Artefact::lost)) {
      REQUIRE(std::ranges::all_of(row, [](double value) { return value == 0.0; }));
      REQUIRE(image.pings[ping].lines[0].first_return == -1);
      REQUIRE_FALSE(said.has(Artefact::repeated));
      ++lost;
      continue;
    }
    // A ping can only repeat one that was recorded.
    REQUIRE(said.has(Artefact::repeated) ==
            (any_yet && is_repeated(scene.artefacts, scene.seed, ping)));
    if (said.has(Artefact::repeated)) {
      REQUIRE(row == row_of(whole, recorded));
      ++repeated;
      repeated_after_lost += image.pings[ping - 1].artefacts.has(Artefact::lost);
    } else {
      REQUIRE(row == row_of(whole, ping));
      recorded = ping;
      any_yet = true;
      ++kept;
    }
    // The record of the row is that of the ping itself.
    REQUIRE(same_pose(image.pings[ping].pose, whole.pings[ping].pose));
  }
  CHECK(lost > 5);
  CHECK(repeated > 5);
  CHECK(repeated_after_lost > 0);
  CHECK(kept > 20);
}

TEST_CASE("while the navigation is stale a run reports the last pose and records this") {
  Scene scene = spoilt_scene();
  SECTION("at any ping") {}
  SECTION("at the first ping, which has no earlier report") {
    while (!(reported_since_s(scene.artefacts, scene.seed, 0.0) < 0.0)) ++scene.seed;
  }
  Simulator simulator(scene);
  const ScenePings all = ping_all(scene, simulator, 1);
  const std::vector<PingRow>& pings = all.images.front().pings;
  CHECK_FALSE(pings[0].artefacts.has(Artefact::stale_navigation));
  int stale = 0;
  for (std::size_t i = 1; i < pings.size(); ++i) {
    CAPTURE(i);
    const bool stands = pings[i].artefacts.has(Artefact::stale_navigation);
    REQUIRE(pings[i].reported.t_s == pings[i].pose.t_s);
    REQUIRE(same_pose(pings[i].reported, stands ? pings[i - 1].reported : pings[i].pose));
    REQUIRE_FALSE(same_pose(pings[i].pose, pings[i - 1].pose));
    stale += stands;
  }
  CHECK(stale > 5);
  CHECK(stale < int(pings.size()) - 5);
}

TEST_CASE("a run with artefacts does not depend on which thread makes which block") {
  const Scene scene = spoilt_scene();
  Simulator one(scene), several(scene);
  const ScenePings alone = ping_all(scene, one, 1), shared = ping_all(scene, several, 3);
  const Waterfall &a = alone.images.front(), &b = shared.images.front();
  for (std::size_t ping = 0; ping < a.rows(); ++ping) {
    REQUIRE(row_of(a, ping) == row_of(b, ping));
    REQUIRE(a.pings[ping].artefacts.bits == b.pings[ping].artefacts.bits);
    REQUIRE(same_pose(a.pings[ping].reported, b.pings[ping].reported));
  }
}
