#include <ensonify/engine/scene/dump.h>
#include <ensonify/engine/scene/tables/strength_table_reader.h>

#include <string>

#include "support/catch.h"
#include "support/files.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify;
using namespace ensonify::engine;
using ensonify::tests::write_text;

namespace {

const std::string scene_text =
    "version = 1\n[seafloor]\nmaterial = \"ground\"\n[material.ground]\nmodel = \"table\"\n";

}  // namespace

// What rows and damaged text may be is in profile_reader_test.cpp, through the same table.

TEST_CASE("A table of strengths is read for one frequency or for several") {
  const auto one = parse_strength_table("strength_db,grazing_deg\n-30,10\n-20,80\n", "s.csv");
  REQUIRE(one->curves().size() == 1);
  CHECK(one->curves()[0].grazing_rad[1] == Approx(80.0 * degree));
  CHECK(one->curves()[0].strength_db[0] == -30.0);
  const auto two = parse_strength_table(
      "grazing_deg,strength_db,frequency_hz\n10,-30,1e5\n80,-20,1e5\n5,-33,4e5\n90,-10,4e5\n", "s");
  REQUIRE(two->curves().size() == 2);
  CHECK(two->curves()[1].frequency_hz == 400e3);
  CHECK(two->curves()[1].strength_db[1] == -10.0);
}

TEST_CASE("A table of strengths that is out of order or out of range is refused with its line") {
  const auto refused = [](const std::string& rows, const std::string& message) {
    CHECK_THROWS_WITH(
        parse_strength_table("grazing_deg,strength_db,frequency_hz\n" + rows, "s.csv"),
        Catch::Contains(message));
  };
  refused("10,-30,1e5\n10,-20,1e5\n", "s.csv:3: grazing_deg is 10 after 10: sort the rows by");
  refused("10,-30,1e5\n5,-20,1e5\n", "s.csv:3: grazing_deg is 5 after 10: sort the rows by");
  refused("10,-30,2e5\n20,-20,2e5\n10,-30,1e5\n", "s.csv:4: frequency_hz is 100000 after 200000");
  refused("10,-30,1e5\n10,-20,2e5\n", "s.csv:3: the frequency before has a single angle");
  refused("10,-30,1e5\n", "s.csv:2: a single angle, expected two at least");
  refused("-1,-30,1e5\n", "s.csv:2: grazing_deg is -1, expected 0 to 90");
  refused("10,-30,1e5\n91,-30,1e5\n", "s.csv:3: grazing_deg is 91, expected 0 to 90");
  refused("10,61,1e5\n", "s.csv:2: strength_db is 61, expected -200 to 60");
  refused("10,-30,0\n", "s.csv:2: frequency_hz is 0, expected 1 to 1000000000");
  refused("10,nan,1e5\n", "s.csv:2: strength_db is 'nan'");
  CHECK_THROWS_WITH(parse_strength_table("grazing_deg\n10\n", "s.csv"),
                    Catch::Contains("s.csv:1: no column strength_db"));
}

TEST_CASE("A scene's material has the strengths of its table, and its file is one of the scene's") {
  const tests::TemporaryFolder folder;
  write_text(folder / "bed.csv", "grazing_deg,strength_db\n10,-30\n90,-10\n");
  const Scene scene =
      parse_scene(scene_text + "table = \"bed.csv\"\n", "s", {}, {folder.path(), {}});
  const auto bed = backscatter_of(scene.materials[0], 400e3, 1500.0, 0.0);
  CHECK(scatter::to_db(bed->cross_section(50.0 * degree)) == Approx(-20.0));
  std::string files;
  for_each_file(scene, [&](const std::string& key, const InputFile& file) {
    if (!file.path.empty()) files += key;
  });
  CHECK(files == "material.ground.table");
  CHECK(dump_scene(scene, false).find("table = \"bed.csv\"") != std::string::npos);
}

TEST_CASE("A table that is missing, elsewhere or not asked for is refused with its key") {
  const tests::TemporaryFolder folder;
  write_text(folder / "bed.csv", "grazing_deg,strength_db\n10,-30\n5,-10\n");
  const auto refused = [&](const std::string& text, const std::string& message) {
    CHECK_THROWS_WITH(parse_scene(text, "s", {}, {folder.path(), {}}), Catch::Contains(message));
  };
  refused(scene_text, "needs a CSV file of strengths: name it as the material's table");
  refused(scene_text + "table = \"no.csv\"\n", "'material.ground.table' names \"no.csv\"");
  refused(scene_text + "table = \"../bed.csv\"\n", "without '..'");
  refused(scene_text + "table = \"data:bed.csv\"\n", "no data folder is known");
  refused(scene_text + "table = \"bed.csv\"\n", "bed.csv:3: grazing_deg is 5 after 10");
  write_text(folder / "bed.csv", "grazing_deg,strength_db\n10,-30\n90,-10\n");
  refused("version = 1\n[material.ground]\nlike = \"clay\"\ntable = \"bed.csv\"\n",
          "'material.ground.table' needs material.ground.model = \"table\"");
  refused("version = 1\n[seafloor]\nmaterial = \"g\"\n[material.g]\nmodel = \"gsab\"\n",
          "needs gsab_lambert_db");
}
