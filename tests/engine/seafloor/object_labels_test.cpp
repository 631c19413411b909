// What objects are labelled as: their parts, assemblies, and the names that a recipe lists.
#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "support/catch.h"
#include "support/paths.h"

#include <ensonify/engine/dataset/recipe.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/seafloor/make_seafloor.h>

using namespace ensonify;
using namespace ensonify::engine;

TEST_CASE("Labels of a seafloor have an object's parts, all with its instance") {
  const Scene scene = parse_scene(R"(
version = 1
[seafloor]
extent_east_m = 60
extent_north_m = 60
cell_m = 1
depth_m = 30
[[objects]]
shape = "wreck"
variant = "upright"
shape_seed = 2
length_m = 20
class = "wreck"
part_classes = true
)",
                                  "parts", {}, {});
  const Seafloor floor = make_seafloor(scene.seafloor, 1, scene.objects, scene.materials, {});
  REQUIRE(floor.objects.size() == 1);
  CHECK(floor.classes[floor.objects[0].label.class_id] == "wreck");
  std::set<std::string> classes, materials;
  for (auto face = static_cast<std::uint32_t>(floor.bed_faces); face < floor.faces; ++face) {
    const Label& label = floor.labels[floor.label_of(face)];
    REQUIRE(label.instance == 1);
    classes.insert(floor.classes[label.class_id]);
    materials.insert(floor.materials[label.sediment]);
  }
  CHECK(classes.count("wreck.hull") == 1);
  CHECK(classes.count("wreck.deck") == 1);
  CHECK(classes.count("wreck") == 0);
  CHECK(materials.count("fouled steel") == 1);
  CHECK(materials.count("wood") == 1);
}

TEST_CASE("Keys of objects that families and assemblies cannot have are refused by name") {
  const auto refused = [](const std::string& objects, const std::string& message) {
    CAPTURE(objects);
    CHECK_THROWS_WITH(parse_scene("version = 1\n" + objects, "keys", {}, {}),
                      Catch::Contains(message));
  };
  refused("[[objects]]\nshape = \"wreck\"\nvariant = \"swept\"", "a wreck is one of: upright");
  refused("[[objects]]\nshape = \"box\"\nvariant = \"swept\"", "a box has no variants");
  refused("[[objects]]\nshape = \"car\"\nfacet_m = 0.1", "is not for a car");
  const std::string base = "[[objects]]\nshape = \"box\"\nassembly = \"a\"\n";
  refused(base + base + "count = 3", "give it to its first object, objects.0");
  refused(base + base + "follow_slope = true", "'objects.1.follow_slope' is for a whole assembly");
  refused(base + "[[objects]]\nshape = \"rope\"\nassembly = \"a\"\npath = [[0, 0], [1, 0]]",
          "laid along a path");
  for (const std::string key : {"scour_ratio", "tail_ratio", "current_deg"})
    refused(fmt::format("{0}{0}{1} = 0.5", base, key),
            fmt::format("'objects.1.{}' is for a whole assembly", key));
}

TEST_CASE(
    "A recipe lists the classes and materials of parts, and an assembly's class as a target") {
  const std::string text = R"(
version = 1
seed = 1
[dataset]
samples = 4
[[objects]]
shape = { choice = ["aircraft", "cable_drum"] }
class = { by = "objects.0.shape", table = { aircraft = "plane", cable_drum = "drum" } }
material = "aluminium"
part_classes = true
[[objects]]
shape = "box"
class = "site"
assembly = "a"
[[objects]]
shape = "mooring"
class = "mooring"
assembly = "a"
)";
  const Recipe recipe(text, std::string("parts"), {});
  const std::vector<std::string> names = recipe.class_names();
  const std::set<std::string> targets(
      names.begin(), names.begin() + static_cast<std::ptrdiff_t>(recipe.target_classes()));
  CHECK(targets == std::set<std::string>{"drum", "plane", "site"});
  for (const char* part : {"plane.wing", "plane.engine", "drum.cable"}) {
    CAPTURE(part);
    CHECK(std::ranges::count(names, part) == 1);
  }
  CHECK(std::ranges::count(names, "mooring") == 0);
  const std::vector<std::string> materials = recipe.material_names();
  for (const char* material : {"aluminium", "fouled steel", "rubber", "concrete"}) {
    CAPTURE(material);
    CHECK(std::ranges::count(materials, material) == 1);
  }
}

namespace {

/// The shapes of a recipe's targets; checks that their beds lie under the whole swath, on the side
/// that the sonar sees.
std::set<std::string> shapes_over_their_beds(const std::string& file, std::size_t samples) {
  const Recipe recipe(tests::source_folder() / "scenes" / file, {});
  std::set<std::string> shapes;
  for (std::size_t number = 0; number < samples; ++number) {
    CAPTURE(file);
    CAPTURE(number);
    const Scene scene = recipe.sample(number).scene;
    if (!scene.objects.empty()) shapes.insert(scene.objects.front().shape);
    const double half_m = 0.5 * scene.seafloor.extent_east_m;
    const double across_m = std::hypot(scene.track.middle_east_m, scene.track.middle_north_m);
    // From the track to the middle of the bed.
    const double to_starboard_m = -scene.track.middle_east_m * std::cos(scene.track.heading_rad) +
                                  scene.track.middle_north_m * std::sin(scene.track.heading_rad);
    if (across_m > 0.0)
      CHECK(scene.sonars.front().sides == (to_starboard_m > 0.0 ? Sides::starboard : Sides::port));
    CHECK(std::max(across_m, scene.sonars.front().range_m - across_m) < half_m);
  }
  return shapes;
}

}  // namespace

TEST_CASE("The recipes for transfer have every shape, on beds under the whole swath") {
  CHECK(shapes_over_their_beds("transfer_targets.toml", 40) ==
        std::set<std::string>{"aircraft", "boat", "wreck"});
  CHECK(shapes_over_their_beds("transfer_seabeds.toml", 40) == std::set<std::string>{"boulder"});
  CHECK(shapes_over_their_beds("all_classes.toml", 200).size() == 23);
}
