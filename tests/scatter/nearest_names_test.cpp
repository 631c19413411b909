#include <ensonify/scatter/nearest_names.h>

#include <string>
#include <vector>

#include "support/catch.h"

using ensonify::scatter::nearest_names;
using Names = std::vector<std::string_view>;

TEST_CASE("names that contain a word, or begin with it, are suggested") {
  const Names names{"fine sand",      "sandy silt",         "silt",
                    "Very_Fine-Sand", "sonar.NAME.range_m", "grain"};
  CHECK(nearest_names("sand", names, 1, 2) == Names{"fine sand", "Very_Fine-Sand"});
  CHECK(nearest_names("san", names, 1, 2) == Names{"sandy silt"});
  CHECK(nearest_names("FINE-sand", Names{"very fine sand"}, 1, 2) == Names{"very fine sand"});
  CHECK(nearest_names("range", names, 1, 2) == Names{"sonar.NAME.range_m"});
  CHECK(nearest_names("and", names, 1, 0).empty());  // a part of a word does not count
  CHECK(nearest_names("m", names, 1, 0).empty());
  CHECK(nearest_names("word", Names(50, "a word"), 1, 2).size() == 12);
}

TEST_CASE("a name that is one edit away is suggested before those that contain the word") {
  const Names names{"embree-single", "embree", "pluecker"};
  CHECK(nearest_names("embre", names, 1, 2) == Names{"embree"});
  CHECK(nearest_names("single", names, 1, 2) == Names{"embree-single"});
}

TEST_CASE("otherwise the nearest names by letters are suggested, if near enough") {
  const Names names{"silt", "salt", "steel", "seat"};
  CHECK(nearest_names("slit", names, 1, 2) == Names{"silt"});  // one swap
  CHECK(nearest_names("silk", names, 2, 2) == Names{"silt", "salt"});
  CHECK(nearest_names("stele", names, 1, 1) == Names{"steel"});
  CHECK(nearest_names("granite", names, 3, 2).empty());
  CHECK(nearest_names("", names, 3, std::string::npos).size() == 3);
  CHECK(nearest_names(std::string(101, 's'), names, 1, 200).empty());
  CHECK(nearest_names("x", {}, 3, 9).empty());
}

TEST_CASE("an abbreviation stands for the shortest name that has its letters in order") {
  const Names names{"array_length_m", "sonar.NAME.ring_gain_db", "sonar.NAME.range_m", "bearing"};
  CHECK(nearest_names("rng", names, 1, 1) == Names{"sonar.NAME.range_m"});
  CHECK(nearest_names("xng", names, 1, 1).empty());
}
