#include <ensonify/engine/image/target_record.h>

#include <numbers>
#include <vector>

#include "support/catch.h"

using namespace ensonify::engine;

namespace {

constexpr double pi = std::numbers::pi;

/// One ping, heading east: object 1 to port, feature 2 to starboard.
Waterfall drawn() {
  Sonar sonar;
  sonar.bins = 4;
  Waterfall image(sonar, 1);
  image.pings.front().pose.heading_rad = 0.5 * pi;
  for (std::uint32_t& region : image.pixels.region)
    region = static_cast<std::uint32_t>(Region::seabed);
  image.pixels.region[1] = static_cast<std::uint32_t>(Region::object);
  image.pixels.instance[1] = 1;
  image.pixels.instance[6] = 2;
  return image;
}

Seafloor bed() {
  Seafloor seafloor;
  seafloor.classes = {"none", "mine", "pockmark"};
  seafloor.materials = {"none", "steel", "silt"};
  seafloor.objects.push_back({.table = 3,
                              .middle_m = {1, 2, 3},
                              .heading_rad = 0.25 * pi,
                              .scale = 2.0,
                              .buried = 0.5,
                              .label = {.sediment = 1, .class_id = 1, .instance = 1}});
  seafloor.features.push_back({.layer = "pits.0",
                               .size_m = {4, 5, 6},
                               .label = {.sediment = 2, .class_id = 2, .instance = 2}});
  return seafloor;
}

}  // namespace

TEST_CASE("a target's record says what is known of the object or feature") {
  const std::vector<ObjectVisibility> views{{.alone = 4, .seen = 1}};
  const std::vector<TargetRecord> records = target_records(drawn(), bed(), views);
  REQUIRE(records.size() == 2);
  const TargetRecord &object = records[0], &feature = records[1];
  REQUIRE(object.is_object());
  CHECK(object.target.instance == 1);
  CHECK(object.class_name == "mine");
  CHECK(object.material == "steel");
  CHECK(object.middle_m == Eigen::Vector3d(1, 2, 3));
  CHECK(object.object->table == 3);
  CHECK(object.object->buried == 0.5);
  CHECK(object.object->visible_share == 0.25);
  // Port of east is north, an eighth of a turn to the left of the object's heading.
  CHECK(object.object->aspect_rad == Approx(-0.25 * pi));
  CHECK(object.layer.empty());

  CHECK(!feature.is_object());
  CHECK(feature.target.instance == 2);
  CHECK(feature.class_name == "pockmark");
  CHECK(feature.layer == "pits.0");
  CHECK(feature.size_m == Eigen::Vector3d(4, 5, 6));
}

TEST_CASE("a share that was not counted is not known") {
  CHECK(!target_records(drawn(), bed()).front().object->visible_share);
  const std::vector<ObjectVisibility> never_met{{}};
  CHECK(!target_records(drawn(), bed(), never_met).front().object->visible_share);
}
