#include <ensonify/engine/session_keys.h>

#include <algorithm>
#include <string>
#include <vector>

#include "support/catch.h"
#include "support/files.h"
#include "support/program.h"
#include "support/temporary_folder.h"
#include "support/tiny_scene.h"

#include <ensonify/refine/error.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

const std::string range_key = "sonar.left-right.range_m";

SessionScene tiny() { return SessionScene(tests::tiny_scene, "tiny", {range_key + "=14"}, {}); }

double range_m(const Scene& scene) { return scene.sonars.front().range_m; }

}  // namespace

TEST_CASE("a kept value of a key replaces earlier values and the value at the start") {
  SessionScene session = tiny();
  CHECK(range_m(session.with()) == 14.0);
  const std::vector<KeyValue> ten{{range_key, "10"}, {"seed", "7"}}, twelve{{range_key, "12"}};
  CHECK(range_m(session.with(ten)) == 10.0);
  CHECK(range_m(session.with()) == 14.0);  // the 10 was not kept
  session.keep(ten);
  session.keep(twelve);
  CHECK(range_m(session.with()) == 12.0);
  CHECK(session.with().seed == 7);
  CHECK(range_m(session.with(ten)) == 10.0);
  CHECK_THROWS_AS(session.with(std::vector<KeyValue>{{range_key, "-1"}}), SceneError);
}

TEST_CASE("taking back a change restores the values before it and keeps later changes") {
  SessionScene session = tiny();
  session.keep(std::vector<KeyValue>{{range_key, "10"}});
  const SessionScene before = session;
  const std::vector<KeyValue> change{{range_key, "11"}, {"seed", "7"}, {"track.pings", "3"}};
  session.keep(change);
  session.keep(std::vector<KeyValue>{{"seed", "8"}});
  session.take_back(change, before);
  CHECK(range_m(session.with()) == 10.0);
  CHECK(session.with().seed == 8);
  CHECK(session.with().track.pings == 9);
}

TEST_CASE("a session's scene reads its file once") {
  const tests::TemporaryFolder folder;
  tests::write_text(folder / "scene.toml", tests::tiny_scene);
  const SessionScene session = SessionScene::of_file(folder / "scene.toml", {}, {});
  tests::write_text(folder / "scene.toml", "damaged");
  CHECK(range_m(session.with()) == 15.0);
  CHECK(session.paths().scene_folder == folder.path());
}

TEST_CASE("a session sets its sonars' keys and no others") {
  SessionScene session = tiny();
  Simulator simulator(session.with());
  for (int i = 0; i < 50; ++i)
    set_sonars(simulator, session, std::vector<KeyValue>{{range_key, i % 2 == 0 ? "10" : "12"}});
  CHECK(simulator.sonars().front().range_m == 12.0);
  CHECK(range_m(session.with()) == 12.0);
  CHECK_THROWS_AS(set_sonars(simulator, session, std::vector<KeyValue>{{"seed", "3"}}), SceneError);
  CHECK_THROWS_AS(set_sonars(simulator, session, std::vector<KeyValue>{{range_key, "-3"}}), Error);
  for (const KeyValue& odd : {KeyValue{"sonar.left-right", "{range_m = 11}"},
                              {"sonar.\"left-right\".range_m", "11"},
                              {"sonar. left-right.range_m", "11"},
                              {"sonar.left-right.\"range_m\"", "11"},
                              {range_key + "=11 #", "1"},
                              {"sonar", "{left-right = {range_m = 11}}"}})
    CHECK_THROWS_WITH(
        set_sonars(simulator, session, std::vector<KeyValue>{odd}),
        Catch::StartsWith("'" + odd.key + "' cannot be set") && Catch::Contains("quotes"));
  CHECK(simulator.sonars().front().range_m == 12.0);
  CHECK(range_m(session.with()) == 12.0);
}

TEST_CASE("keys of two sonars are set together, or neither") {
  const tests::TemporaryFolder folder;
  tests::write_text(folder / "bad.csv", "garbage");
  SessionScene session(tests::tiny_scene + "\n[sonar.other]\nrange_m = 15\nbins = 100\n", "two", {},
                       {.scene_folder = folder.path()});
  Simulator simulator(session.with());
  const std::vector<std::string> warnings(simulator.warnings().begin(), simulator.warnings().end());
  // 17 elevations are warned of, and a table that cannot be read is found only after that.
  const std::vector<KeyValue> bad{{range_key, "10"},
                                  {"sonar.left-right.elevations", "17"},
                                  {"sonar.other.vertical_pattern", "\"bad.csv\""}};
  CHECK_THROWS_AS(set_sonars(simulator, session, bad), Error);
  CHECK(simulator.sonars()[0].range_m == 15.0);
  CHECK(range_m(session.with()) == 15.0);
  CHECK(std::ranges::equal(simulator.warnings(), warnings));
  set_sonars(simulator, session,
             std::vector<KeyValue>{{range_key, "10"}, {"sonar.other.range_m", "11"}});
  CHECK(simulator.sonars()[0].range_m == 10.0);
  CHECK(simulator.sonars()[1].range_m == 11.0);
}

TEST_CASE("after a preset all sonars are those of a scene with these keys") {
  SessionScene session(tests::tiny_scene + "\n[sonar.other]\nrange_m = 15\nbins = 100\n", "two", {},
                       {});
  Simulator simulator(session.with());
  CHECK(simulator.sonars()[1].receiver.looks == 1);
  set_sonars(simulator, session,
             std::vector<KeyValue>{{"sonar.left-right.preset", "\"deepvision-de340\""}});
  CHECK(session.with().sonars[1].receiver.looks == 3);
  for (std::size_t number = 0; number < 2; ++number)
    CHECK(simulator.sonars()[number].receiver.looks ==
          session.with().sonars[number].receiver.looks);
}

TEST_CASE("lost and repeated pings of a scene are warned of where pings are single") {
  CHECK(warnings_for_single_pings(tiny().with()).empty());
  for (const std::string key : {"artefacts.lost", "artefacts.repeated"}) {
    const auto warnings =
        warnings_for_single_pings(tiny().with(std::vector<KeyValue>{{key, "0.1"}}));
    REQUIRE(warnings.size() == 1);
    CHECK(warnings[0].starts_with(key + ": has no effect on single pings"));
  }
}

TEST_CASE("an error of a session's key does not speak of the command line") {
  const std::string sonar = "sonar.left-right.";
  CHECK_THROWS_WITH(tiny().with(std::vector<KeyValue>{{range_key, "-3"}}),
                    Catch::StartsWith(range_key + "=-3: "));
  CHECK_THROWS_WITH(tiny().with(std::vector<KeyValue>{{sonar + "sector_low_deg", "140"}}),
                    Catch::Contains("; with " + range_key + "=14 " + sonar + "sector_low_deg=140"));
}

TEST_CASE("an object is made from the keys of its table") {
  const auto object_with = [](const std::vector<KeyValue>& keys) {
    return object_of(keys, "'add'", tiny().with(), {}, 1);
  };
  const MovingObject object = object_with({{"shape", "\"cylinder\""}, {"class", "\"mine\""}});
  CHECK(object.class_name == "mine");
  CHECK(object.material == "fouled steel");
  CHECK(!object.mesh.faces.empty());
  CHECK_THROWS_AS(object_with({{"shape", "\"teapot\""}}), SceneError);
  CHECK_THROWS_AS(object_with({{"no such key", "1"}}), SceneError);
  CHECK_THROWS_AS(object_with({{"shape", "\"box\"\n[[objects]]\nshape = \"box\""}}), SceneError);
  for (const char* key : {"heading_deg", "east_m", "height_m", "count"})
    CHECK_THROWS_WITH(object_with({{"shape", "\"box\""}, {key, "1"}}),
                      Catch::Contains(key) && Catch::Contains("where its pose says"));
  for (const char* key : {"scour_ratio", "tail_ratio", "current_deg"})
    CHECK_THROWS_WITH(object_with({{"shape", "\"box\""}, {key, "0.5"}}),
                      Catch::Contains(key) && Catch::Contains("is for objects of the scene"));
  CHECK_THROWS_WITH(object_with({{"shape", "\"pipeline\""}}), Catch::Contains("cannot be added"));
  CHECK_THROWS_WITH(object_with({{"shape", "\"wreck\""}, {"part_classes", "true"}}),
                    Catch::Contains("is for objects of the scene"));
}

TEST_CASE("an object of a session may have a material of its scene") {
  const auto object_with = [](const std::string& material) {
    const std::vector<KeyValue> keys{{"shape", "\"barrel\""}, {"material", '"' + material + '"'}};
    return object_of(keys, "'add'", tiny().with(), {}, 1);
  };
  CHECK(object_with("plain").material == "plain");
  CHECK_THROWS_WITH(object_with("plane"), Catch::Contains("'plane' is not known"));
  Simulator simulator(tiny().with());
  CHECK(simulator.add(object_with("plain"), {.position = {5.0, 0.0, -19.0}}) == 1);
}

TEST_CASE("a boulder of a session has the form that its seed and number say, or its own seed") {
  const auto form = [](std::uint64_t seed, std::uint32_t number, std::vector<KeyValue> more = {}) {
    more.push_back({"shape", "\"boulder\""});
    Scene scene = tiny().with();
    scene.seed = seed;
    return object_of(more, "'add'", scene, {}, number).mesh.positions;
  };
  CHECK(form(1, 1) == form(1, 1));
  CHECK(form(1, 1) != form(1, 2));
  CHECK(form(1, 1) != form(2, 1));
  const std::vector<KeyValue> own{{"shape_seed", "5"}};
  CHECK(form(1, 1, own) == form(2, 2, own));
}
