#include <ensonify/engine/image/target_record.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "support/catch.h"

using namespace ensonify::engine;

namespace {

constexpr double pi = std::numbers::pi;

/// One ping, heading east: object 1 to port, feature 2 to starboard.
Waterfall one_ping() {
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

Seafloor labelled_bed() {
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
  const std::vector<TargetRecord> records = target_records(one_ping(), labelled_bed(), views);
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

TEST_CASE("the side and the aspect are those of the sonar, however it is mounted") {
  const auto aspect_rad = [](const Waterfall& image) {
    return target_records(image, labelled_bed()).front().object->aspect_rad;
  };
  for (const Sides sides : {Sides::port, Sides::starboard}) {
    Waterfall image = one_ping();
    image.sonar.sides = sides;
    image.sonar.bins = 8;  // all columns are of one side
    const bool port = sides == Sides::port;
    CHECK(target_records(image, labelled_bed()).front().target.sight.sector() ==
          (port ? "port" : "starboard"));
    // North, or south, less the object's heading.
    CHECK(aspect_rad(image) == Approx(port ? -0.25 * pi : 0.75 * pi));
    image.sonar.mounting.azimuth_rad = -0.5 * pi;  // starboard looks ahead, to the east
    CHECK(std::cos(aspect_rad(image) - (port ? -0.75 * pi : 0.25 * pi)) == Approx(1.0));
  }
}

TEST_CASE("the aspect of what two legs see from one direction is that direction") {
  Sonar sonar;
  sonar.bins = 4;
  Waterfall image(sonar, 2);
  image.pings[0].pose.heading_rad = 0.0;
  image.pings[1].pose.heading_rad = pi;  // back again: what was to starboard is to port
  for (const std::size_t pixel : {6, 8 + 1}) {
    image.pixels.region[pixel] = static_cast<std::uint32_t>(Region::object);
    image.pixels.instance[pixel] = 1;
  }
  const double aspect_rad = target_records(image, labelled_bed()).front().object->aspect_rad;
  CHECK(std::cos(aspect_rad - 0.25 * pi) == Approx(1.0));  // east less the heading
}

TEST_CASE("a share that was not counted is not known") {
  CHECK(!target_records(one_ping(), labelled_bed()).front().object->visible_share);
  const std::vector<ObjectVisibility> never_met{{}};
  CHECK(!target_records(one_ping(), labelled_bed(), never_met).front().object->visible_share);
}
