#include <ensonify/engine/scene/tables/vertical_pattern_reader.h>

#include "support/catch.h"

#include <ensonify/engine/base/units.h>

using namespace ensonify::engine;

// What rows and damaged text may be is in profile_reader_test.cpp, through the same table.

TEST_CASE("A measured vertical pattern is read for both sides or for each side, in any order") {
  const auto both = parse_vertical_pattern("level_db,depression_deg\n-3,40\n-20,-90\n0,30\n", "v");
  for (const auto& side : both) {
    REQUIRE(side.size() == 3);
    CHECK(side[0].depression_rad == Approx(-90.0 * degree));
    CHECK(side[1].level_db == 0.0);
    CHECK(side[2].depression_rad == Approx(40.0 * degree));
    CHECK(side[2].level_db == -3.0);
  }
  const auto apart =
      parse_vertical_pattern("depression_deg,port_db,starboard_db\n0,-1,-2\n10,-3,-4\n", "v");
  CHECK(apart[0][1].level_db == -3.0);
  CHECK(apart[1][1].level_db == -4.0);
}

TEST_CASE("A vertical pattern that cannot be one is refused with its line") {
  const auto refused = [](const std::string& text, const std::string& message) {
    CHECK_THROWS_WITH(parse_vertical_pattern(text, "v.csv"), Catch::Contains(message));
  };
  refused("depression_deg\n0\n10\n", "v.csv:2: expected the columns level_db, or port_db");
  refused("depression_deg,port_db\n0,-1\n1,-1\n", "expected the columns level_db, or port_db");
  refused("depression_deg,level_db,port_db,starboard_db\n0,-1,-1,-1\n", "expected the columns");
  refused("depression_deg,level_db\n0,-1\n", "v.csv:2: a single level, expected two");
  refused("depression_deg,level_db\n0,-1\n181,-1\n",
          "v.csv:3: depression_deg is 181, expected -90 (straight up) to 180");
  refused("depression_deg,level_db\n0,-1\n10,3\n", "v.csv:3: level_db is 3, expected -200 to 0");
  refused("depression_deg,level_db\n10,-1\n0,-1\n10,-2\n",
          "v.csv:4: depression_deg 10 is there twice");
}
