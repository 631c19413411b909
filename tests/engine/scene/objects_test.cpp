#include <string>
#include <vector>

#include "support/catch.h"
#include "support/parsed_scene.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/scene/dump.h>
#include <ensonify/engine/scene/reader.h>

using namespace ensonify::engine;
using ensonify::tests::error_of;

namespace {

const std::string objects_head = "version = 1\n[[objects]]\n";

}  // namespace

TEST_CASE("A shape, its sizes, its path and its area are read, and read back from a dump") {
  const std::string text =
      objects_head +
      "shape = \"cone\"\ntop_diameter_m = 0.3\ncount = 7\n"
      "area = [[0, 0], [10.5, 0], [0, -10]]\nheading_spread_deg = 20\n"
      "[[objects]]\nshape = \"cable\"\npath = [[-1, 2], [3e1, 4]]\n"
      "sag_radius_m = 12\nburial = 0.5\nburial_spread = 0.3\nburial_scale_m = 5\n";
  const Scene scene = parse_scene(text, "s.toml", {}, {});
  CHECK(scene.objects[0].shape == "cone");
  CHECK(scene.objects[0].size.top_diameter_m == 0.3);
  CHECK_FALSE(scene.objects[0].size.diameter_m);
  CHECK(scene.objects[0].count == 7);
  REQUIRE(scene.objects[0].area.size() == 3);
  CHECK(scene.objects[0].area[1] == Eigen::Vector2d(10.5, 0.0));
  CHECK(scene.objects[0].heading_spread_rad == Approx(20.0 * degree));
  REQUIRE(scene.objects[1].path.size() == 2);
  CHECK(scene.objects[1].path[1] == Eigen::Vector2d(30.0, 4.0));
  for (const bool with_comments : {true, false}) {
    const std::string dumped = dump_scene(scene, with_comments);
    const Scene back = parse_scene(dumped, "dumped", {}, {});
    CHECK(back.objects[0].area == scene.objects[0].area);
    CHECK(back.objects[1].path == scene.objects[1].path);
    CHECK(back.objects[1].sag_radius_m == 12.0);
    CHECK(back.objects[1].burial_spread == 0.3);
    CHECK(back.objects[1].burial_scale_m == 5.0);
    CHECK(dump_scene(back, with_comments) == dumped);
  }
  const std::vector<std::string> changed{"objects.1.path=[[0, 0], [1, 1], [2, 3]]"};
  CHECK(parse_scene(text, "s.toml", changed, {}).objects[1].path.size() == 3);
  CHECK(schema_text().find("| `tyre` |") != std::string::npos);
}

TEST_CASE("An error in an object is reported once, with its place") {
  const std::string cone = "shape = \"cone\"\n", cable = "shape = \"cable\"\n";
  for (
      const auto& [keys, message] : std::vector<std::pair<std::string, std::string>>{
          {"shape = \"kone\"",
           "s.toml:3:9: 'objects.0.shape' is the string \"kone\", expected one of cylinder, cone,"},
          {cone + "mesh = \"a.ply\"",
           "s.toml:3:9: 'objects.0.shape' and 'objects.0.mesh' are both given"},
          {cone + "length_m = 2",
           "s.toml:4:12: 'objects.0.length_m' is not a size of a cone, which has diameter_m, "
           "top_diameter_m, tall_m"},
          {cone + "diameter_m = -1",
           "s.toml:4:14: 'objects.0.diameter_m' is -1, expected a number from 0.001 to 1000 m"},
          {"mesh = \"a.ply\"\ntall_m = 2", "s.toml:4:10: 'objects.0.tall_m' is a shape's size"},
          {"mesh = \"a.ply\"\nfacet_m = 2", "s.toml:4:11: 'objects.0.facet_m' is for shapes"},
          {cone + "weld_m = 1", "s.toml:4:10: 'objects.0.weld_m' is for meshes"},
          {cone + "path = [[0, 0], [1, 1]]", "s.toml:4:8: 'objects.0' has a path, which is for a"},
          {cone + "speed_mps = 1", "s.toml:4:13: 'objects.0.speed_mps' needs a path: give either"},
          {cone + "path = [[1, 1]]\nspeed_mps = 0",
           "s.toml:5:13: 'objects.0.speed_mps' is 0, expected a number from 0.001 to 100 m/s"},
          {cone + "path = [[1, 1]]\nspeed_mps = 1\ncount = 2",
           "s.toml:5:13: 'objects.0.speed_mps' moves the object, but objects with a count are at"},
          {cone + "path = [[1, 1]]\nspeed_mps = 1\nburial = 0.2",
           "s.toml:5:13: 'objects.0.speed_mps' moves the object, but a part of it is in the bed"},
          {cone + "path = [[1, 1]]\nspeed_mps = 1\nscour_ratio = 0.2",
           "s.toml:5:13: 'objects.0.speed_mps' moves the object, but scour_ratio and tail_ratio"},
          {cone + "path = [[1, 1]]\nspeed_mps = 1\nassembly = \"a\"",
           "s.toml:5:13: 'objects.0.speed_mps' moves the object, but assemblies are at rest"},
          {cone + "poses = \"a.csv\"\npath = [[1, 1]]\nspeed_mps = 1",
           "s.toml:4:9: 'objects.0.poses' and 'objects.0.speed_mps' are both given"},
          {cable + "path = [[0, 0], [1, 1]]\nspeed_mps = 1",
           "s.toml:5:13: 'objects.0.speed_mps' moves the object, but what lies along a path is at"},
          {cone + "sag_radius_m = 2", "s.toml:4:16: 'objects.0.sag_radius_m' is for a pipeline"},
          {cone + "burial_spread = 0.2",
           "s.toml:4:17: 'objects.0.burial_spread' is for a pipeline"},
          {cable + "path = [[0, 0], [1, 1]]\nburial_spread = 0.2",
           "s.toml:5:17: 'objects.0.burial_spread' changes the burial: give 'objects.0.burial'"},
          {cable, "s.toml:2:1: 'objects.0' lies along a path: give either"},
          {cable + "path = [[0, 0]]", "s.toml:4:8: 'objects.0.path' has no length"},
          {cable + "path = [[0, 0], [1]]",
           "s.toml:4:8: 'objects.0.path' is an array, expected points [[east, north], ...], each "
           "number from -1000000 to 1000000 m; point 2 is not"},
          {cable + "path = [[0, 0], [1, \"2\"]]", "s.toml:4:8: 'objects.0.path' is an array"},
          {cable + "path = [[0, 0], [1, nan]]", "s.toml:4:8: 'objects.0.path' is an array"},
          {cable + "path = 3", "s.toml:4:8: 'objects.0.path' is 3, expected points"},
          {cable + "path = [[0, 0], [1, 1]]\npitch_deg = 3",
           "s.toml:2:1: 'objects.0' lies along a path as the bed does"},
          {cone + "burial = 0.5\nheight_m = -1",
           "s.toml:4:10: 'objects.0.burial' and 'objects.0.height_m' are both given"},
          {cone + "burial = 1.5", "s.toml:4:10: 'objects.0.burial' is 1.5, expected a number from"},
          {cone + "gap_m = 2", "s.toml:4:9: 'objects.0.gap_m' is for objects at random places"},
          {"shape = \"boulder\"\nscale = 1e6",
           "s.toml:4:9: 'objects.0.scale' makes a boulder with a diameter_m of"},
          {cone + "scale_max = 2", "s.toml:4:13: 'objects.0.scale_max' is for objects at random"},
          {cone + "count = 3\nscale_min = 2",
           "s.toml:3:1: 'objects.0.scale_max' is 1, less than scale_min, which is 2"},
          {cone + "count = -3", "s.toml:4:9: 'objects.0.count' is -3, expected a whole number"},
          {cone + "count = 3\narea = [[0, 0], [1, 1]]",
           "s.toml:5:8: 'objects.0.area' has 2 points, expected a polygon of three or more"},
          {cone + "count = 3\narea_radius_m = 5\narea = [[0, 0], [1, 1], [2, 0]]",
           "s.toml:5:17: 'objects.0.area' and 'objects.0.area_radius_m' are both given"},
          {cone + "count = 60000\n[[objects]]\n" + cone + "count = 10000",
           "s.toml: the scene has 70000 objects, expected at most 65534"}}) {
    CAPTURE(keys);
    const std::string error = error_of(objects_head + keys);
    INFO(error);
    CHECK(error.substr(error.find(": ")).starts_with(message.substr(message.find(": "))));
    if (message.find("less than scale_min") == std::string::npos)
      CHECK(error.starts_with(message.substr(0, message.find(": "))));
  }
}
