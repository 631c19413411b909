// The pictures and labels of a dataset: whole lines, tiles and chips.

#include <map>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/catch.h"
#include "support/files.h"
#include "support/generate.h"
#include "support/tiny_recipe.h"
#include "support/tree.h"

using namespace ensonify::tests;
namespace fs = std::filesystem;
using Json = nlohmann::json;

TEST_CASE("labels fit their pictures, whole and cut: boxes lie inside, and areas fit into boxes") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml", tiny_recipe);
  generate_whole(folder.path(), "set");
  REQUIRE(run_program(folder.path(), {"merge", "set", "--quiet"}).code == 0);
  const Json coco = Json::parse(read_text(folder / "set/coco/slant_line_train.json"));
  CHECK(coco.at("categories").size() == 2);
  CHECK(coco.at("images").size() == 2 * 4);  // two displays of half the samples
  CHECK(coco.at("annotations").size() > 0);
  for (const Json& annotation : coco.at("annotations")) {
    CHECK(annotation.at("shown_fraction") == 1.0);
    CHECK(annotation.at("truncated") == false);
    CHECK(annotation.at("bbox").at(0).get<int>() + annotation.at("bbox").at(2).get<int>() <= 160);
    CHECK(annotation.at("area").get<int>() <=
          annotation.at("bbox").at(2).get<int>() * annotation.at("bbox").at(3).get<int>());
  }
  // Each chip has its size and at least one target; background chips have none.
  int chips = 0;
  for (const auto& [name, text] : tree_of(folder / "set/samples")) {
    if (name.find("/chips/") == std::string::npos || !name.ends_with(".json")) continue;
    const Json image = Json::parse(text);
    if (image.at("kind") == "background") CHECK(image.at("targets").empty());
    if (image.at("kind") != "chip") continue;
    ++chips;
    CHECK(image.at("targets").size() >= 1);
    CHECK((image.at("width") == 9 && image.at("height") == 9));
  }
  CHECK(chips > 0);
}

TEST_CASE("tiles of the size of the pictures are made, and larger ones refused before any bed is") {
  const TemporaryFolder folder;
  const std::string moving = changed(
      changed(changed(tiny_recipe, "bins = 80", "bins = 80\nbeams = 3\nbeam_spacing_m = 0.17"),
              "[track]\n",
              "[motion]\nheading = { rms_deg = 3, period_s = 2 }\nsway = { rms_m = 0.2, "
              "period_s = 1 }\nsurge = { rms_m = 0.2, period_s = 1 }\nspeed = { rms_mps = 1, "
              "period_s = 1 }\n[track]\n"),
      "samples = 8\nseafloors = 4", "samples = 1");
  write_text(folder / "recipe.toml", moving);
  generate_whole(folder.path(), "set");
  const auto made = [&](const std::string& image) {
    return Json::parse(read_text(folder / ("set/samples/000000/" + image + ".json")));
  };
  const Json slant = made("left-right"), ground = made("left-right_ground");
  const auto check = [&](const std::string& off, std::vector<std::string> whole,
                         const std::vector<std::string>& larger) {
    write_text(folder / "recipe.toml", changed(changed(moving, "ground_px_m = 0.25", off),
                                               "size_px = 9", "margin = [0.5]"));
    whole.emplace_back("--dry-run");
    CHECK(generate(folder.path(), "none", whole).code == 0);
    for (const std::string& one : larger) {
      CAPTURE(one);
      std::vector<std::string> more = whole;
      more.insert(more.end(), {"-D", one});
      for (const bool dry : {true, false}) {
        if (!dry) std::erase(more, "--dry-run");
        const Outcome refused = generate(folder.path(), "none", more);
        CHECK(refused.code == 2);
        CHECK(refused.err.find("'dataset.tiles' needs ") != std::string::npos);
      }
    }
    CHECK(!fs::exists(folder / "none"));
  };
  const auto pixels = [](const std::string& key, const Json& image, const std::string& of,
                         int more) {
    return "dataset.tiles." + key + "=" + std::to_string(image.at(of).get<int>() + more);
  };
  for (const auto& [off, image] :
       {std::pair<std::string, Json>{"", slant}, {"slant = false\nground_px_m = 0.25", ground}})
    check(off,
          {"-D", pixels("width_px", image, "width", 0), "-D",
           pixels("height_px", image, "height", 0)},
          {pixels("width_px", image, "width", 1), pixels("height_px", image, "height", 1)});
  // In metres: the last tile that still rounds to the whole length, and the first that does not.
  const auto metres = [&](double pixels_along) {
    return "dataset.tiles.height_m=" +
           std::to_string(pixels_along * slant.at("pixel_along_m").get<double>());
  };
  const double rows = slant.at("height").get<double>();
  check("",
        {"-D", "dataset.tiles.width_px=0", "-D", "dataset.tiles.height_px=0", "-D",
         "dataset.tiles.width_m=3", "-D", metres(rows + 0.49)},
        {metres(rows + 0.51)});
}

TEST_CASE("a target is truncated if a longer line or range shows more of it, in all its images") {
  const TemporaryFolder folder;
  std::string scene = changed(tiny_recipe, "samples = 8\nseafloors = 4", "samples = 1");
  for (const auto& [from, to] : {std::pair{"depth_m = { uniform = [12, 20] }", "depth_m = 12"},
                                 {"altitude_m = { uniform = [2, 4] }", "altitude_m = 3"},
                                 {"elevations = 160", "elevations = 600"},
                                 {"size_px = 9\nbackgrounds = 1", "margin = [1]"}})
    scene = changed(scene, from, to);
  const std::size_t objects = scene.find("[[objects]]");
  scene.erase(objects, scene.find("[track]") - objects);
  // Boxes at the last ping, in the middle, and at the full range.
  for (const char* place :
       {"east_m = 6\nnorth_m = 4", "east_m = -6\nnorth_m = 0", "east_m = 11.6\nnorth_m = 0"})
    scene += std::string(
                 "[[objects]]\nshape = \"box\"\nclass = \"crate\"\nmaterial = \"plain\"\n"
                 "length_m = 3\nwidth_m = 1.6\ntall_m = 1\n") +
             place + "\n";
  write_text(folder / "recipe.toml", scene);
  generate_whole(folder.path(), "set");
  generate_whole(folder.path(), "longer",
                 {"-D", "track.pings=28", "-D", "sonar.left-right.range_m=15", "-D",
                  "sonar.left-right.bins=100"});
  const auto targets = [&](const std::string& image) {
    std::map<int, Json> all;
    const Json labels = Json::parse(read_text(folder / (image + ".json")));
    for (const Json& one : labels.at("targets")) all[one.at("instance").get<int>()] = one;
    return all;
  };
  constexpr int in_the_middle = 2;
  const auto found = targets("set/samples/000000/left-right");
  const auto whole = targets("longer/samples/000000/left-right");
  REQUIRE(found.size() == 3);
  for (const auto& [instance, target] : found) {
    CAPTURE(instance);
    const Json& seen_whole = whole.at(instance);
    CHECK(target.at("shown_fraction") == 1.0);
    CHECK(target.at("truncated") == (instance != in_the_middle));
    CHECK(target.at("truncated") ==
          (seen_whole.at("body").at("area_px") > target.at("body").at("area_px")));
    CHECK(seen_whole.at("truncated") == false);
  }
  // An image that shows as much as the line does not show more.
  int images = 0;
  for (const auto& [name, text] : tree_of(folder / "set/samples/000000")) {
    const bool of_image = name.starts_with("chips/") || name.starts_with("tiles/") ||
                          name == "left-right_ground.json";
    if (!of_image || !name.ends_with(".json")) continue;
    const Json labels = Json::parse(text);
    for (const Json& target : labels.at("targets")) {
      CAPTURE(name);
      ++images;
      CHECK(target.at("truncated") ==
            (target.at("instance") != in_the_middle || target.at("shown_fraction") < 1.0));
    }
  }
  CHECK(images > 9);
}
