#include <fstream>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/scene/dump.h>
#include <ensonify/engine/scene/reader.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/parsed_scene.h"
#include "support/temporary_folder.h"

using namespace ensonify::engine;
using ensonify::tests::error_of, ensonify::tests::TemporaryFolder, ensonify::tests::write_text;

namespace {

const std::string layers = R"(version = 1
[seafloor]
extent_east_m = 60
extent_north_m = 40
[[seafloor.patches]]
material = "sandy mud"
polygon_m = [[-10, -10], [10.5, -10], [0, 12.25]]
ragged_m = 1.5
[[seafloor.patches]]
material = "own"
class = "seagrass"
on = "sandy mud"
share = 0.25
[[seafloor.crests]]
wavelength_m = 1.5
across_crests_deg = 33.3
gentlest_deg = 0.1
[[seafloor.trawl_marks]]
class = ""
count = 3
[[seafloor.outcrops]]
[[seafloor.boulders]]
on = "own"
[material.own]
model = "lambert"
)";

std::string with(const std::string& patch) {
  return "version = 1\n[seafloor]\nextent_east_m = 60\nextent_north_m = 40\n" + patch;
}

}  // namespace

TEST_CASE("Patches and layers of relief are read, overridden and dumped to the same") {
  const Scene scene = parse_scene(layers, "s.toml", {{"seafloor.crests.0.height_m=0.25"}});
  const SeabedOptions& bed = scene.seafloor.seabed;
  REQUIRE(bed.patches.size() == 2);
  CHECK(bed.patches[0].area.polygon_m == Polygon{{-10.0, -10.0}, {10.5, -10.0}, {0.0, 12.25}});
  CHECK(bed.patches[1].class_name == "seagrass");
  CHECK(bed.bedforms[0].relief.height_m == 0.25);
  CHECK(bed.bedforms[0].area.gentlest_rad);
  CHECK(bed.trawl_marks[0].class_name.empty());
  CHECK(bed.outcrops[0].class_name == "outcrop");
  CHECK(bed.boulders[0].material == "stone");
  for (const bool with_comments : {true, false}) {
    const std::string text = dump_scene(scene, with_comments);
    const Scene back = parse_scene(text, "dumped");
    CHECK(dump_scene(back, with_comments) == text);
    CHECK(back.seafloor.seabed.trawl_marks[0].class_name.empty());
    CHECK(back.seafloor.seabed.patches[0].area.polygon_m == bed.patches[0].area.polygon_m);
    CHECK(back.seafloor.seabed.bedforms[0].relief.across_crests_rad ==
          bed.bedforms[0].relief.across_crests_rad);
  }
}

TEST_CASE("An error in a patch names its file and line") {
  const auto check = [](const std::string& patch, const std::string& line,
                        const std::string& words) {
    const std::string message = error_of(with(patch));
    INFO(message);
    CHECK(message.starts_with("s.toml:" + line));
    CHECK(message.find(words) != std::string::npos);
  };
  check("[[seafloor.patches]]\npolygon_m = [[0, 0], [4, 4], [4, 0], [0, 4]]\n",
        "6:", "crosses itself");
  check("[[seafloor.patches]]\npolygon_m = [[0, 0], [4, 4]]\n", "6:", "three to 1000 points");
  check("[[seafloor.patches]]\npolygon_m = [[0, 0], [4, \"x\"], [1, 2]]\n", "6:", "point 2 is not");
  check("[[seafloor.patches]]\npolygon_m = [[50, 0], [54, 0], [50, 4]]\n",
        "6:", "outside the seabed");
  check("[[seafloor.pits]]\nradius_m = 4\nmiddle_north_m = 70\n", "6:", "outside the seabed");
  check("[[seafloor.patches]]\nmaterial = \"mud pie\"\n", "6:", "mud pie");
  check("[[seafloor.patches]]\nmaterial = \"\"\n", "6:", "empty");
  for (const char* list : {"patches", "boulders"})
    check("[[seafloor." + std::string(list) + "]]\nclass = \"none\"\n",
          "6:", "\"none\", which is the name of number 0");
  check("[[seafloor.boulders]]\nmaterial = \"mud pie\"\n", "6:", "mud pie");
  const std::string steel =
      "[[seafloor.patches]]\nmaterial = \"x\"\n[material.x]\nlike = \"steel\"\n";
  check(steel + "model = \"lambert\"\n", "8:", "is for sediments");
  check(steel + "model = \"gsab\"\ngsab_lambert_db = -25\n", "9:", "is for sediments");
  check("[[seafloor.crests]]\non = \"clay\"\n", "6:", "no part of the map");
  check("[[seafloor.crests]]\nwavelength_m = 0.5\n", "6:", "need cells of");
  check("[[seafloor.crests]]\nwavelenth_m = 0.5\n", "6:", "did you mean 'wavelength_m'?");
  check("[[seafloor.crest]]\n", "5:", "unknown key");
  check("[[seafloor.patches]]\nshallowest_m = 5\ndeepest_m = 4\n", "7:", "shallowest_m");
  check("detail.cell_m = 0.1\n", "5:", "survey");
  check("[seafloor.patches]\n", "5:", "[[seafloor.patches]]");
  CHECK(error_of(layers + "[[seafloor.crests]]\nnumber = 1\n", {})
            .find("has the number 1 as 'seafloor.crests.0'") != std::string::npos);
  CHECK(error_of(layers, {"seafloor.crests.1.height_m=0.1"}).find("it has 1, numbered from 0") !=
        std::string::npos);
  CHECK(
      error_of(layers, {"seafloor.crests=[{height_m=0.1}, {}]"})
          .find(
              "expected one of the scene's tables by its number, as in seafloor.crests.0.KEY=VALUE") !=
      std::string::npos);
  CHECK(error_of("version = 1\n[seafloor]\nkind = \"mesh\"\nmesh = \"a.ply\"\n[[seafloor.pits]]\n")
            .find("needs a grid of heights") != std::string::npos);
}

TEST_CASE("An image that does not fit the seabed is refused before anything is made") {
  const TemporaryFolder folder;
  const auto write_pgm = [&](const std::string& name, const std::string& bytes) {
    std::ofstream(folder / name, std::ios::binary) << bytes;
  };
  write_pgm("damaged.png", "\x89PNG\r\n\x1a\n not one");
  const ScenePaths paths{folder.path(), {}};
  const std::string message =
      error_of(with("[[seafloor.patches]]\nimage = \"damaged.png\"\n"), {}, paths);
  INFO(message);
  CHECK(message.starts_with("s.toml:6:"));
  CHECK(message.find("damaged.png") != std::string::npos);
  CHECK(error_of(with("[[seafloor.patches]]\nimage = \"none.png\"\n"), {}, paths)
            .starts_with("s.toml:6:"));
}

TEST_CASE("An outline may be smaller than the seabed, but not smaller than its cells") {
  const TemporaryFolder folder;
  const auto error_of_square = [&](double side) {
    const auto corner = [&](double x, double y) {
      return fmt::format("[{},{}]", x * side, y * side);
    };
    write_text(folder / "area.geojson",
               fmt::format(R"({{"type":"Polygon","coordinates":[[{},{},{},{},{}]]}})", corner(0, 0),
                           corner(1, 0), corner(1, 1), corner(0, 1), corner(0, 0)));
    return error_of(with("cell_m = 0.5\n[[seafloor.patches]]\noutline = \"area.geojson\"\n"), {},
                    {.scene_folder = folder.path()});
  };
  for (const double side_m : {1.0, 10.0, 39.0, 100.0}) {
    CAPTURE(side_m);
    CHECK(error_of_square(side_m) == "no error");
  }
  CHECK_THAT(error_of_square(0.1), Catch::Contains("seems to be in degrees"));
}
