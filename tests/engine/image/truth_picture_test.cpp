#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include <ensonify/engine/image/picture_columns.h>
#include <ensonify/engine/image/truth.h>
#include <ensonify/engine/image/truth_picture.h>

#include "support/catch.h"

using namespace ensonify::engine;

namespace {

/// Two pings of one side, four bins: water, seabed of two sediments, an object and its shadow.
Waterfall small_image() {
  Sonar sonar;
  sonar.sides = Sides::starboard;
  sonar.bins = 4;
  Waterfall image(sonar, 2);
  image.pixels.region = {1, 2, 2, 0, 1, 2, 3, 4};
  image.pixels.class_id = {0, 1, 1, 0, 0, 1, 2, 0};
  image.pixels.sediment = {0, 1, 2, 0, 0, 1, 3, 0};
  image.pixels.instance = {0, 0, 0, 0, 0, 0, 1, 0};
  image.pixels.shadow_instance = {0, 0, 0, 0, 0, 0, 0, 1};
  return image;
}
const PictureColumns bin_columns{.over_ground = false, .per_side = 4};  // of the same
const std::vector<std::string> classes = {"none", "seabed", "mine"};
const std::vector<std::string> materials = {"none", "mud", "sand", "steel"};

std::vector<std::string> names(const TruthPicture& truth) {
  std::vector<std::string> all;
  for (const LegendEntry& entry : truth.legend) all.push_back(entry.name);
  return all;
}

}  // namespace

TEST_CASE("The legend lists the labels in the picture, classes first, in different colours") {
  const Picture grey{4, 2, 1, std::vector<std::uint8_t>(8, 100)};
  const TruthPicture truth = lay_truth(small_image(), grey, classes, materials, bin_columns);
  CHECK(names(truth) ==
        std::vector<std::string>{"mine", "mud", "sand", "shadow", "water column", "no data"});
  for (std::size_t a = 0; a < truth.legend.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) CHECK(truth.legend[a].colour != truth.legend[b].colour);
  // The newest ping is on top, and half of a tinted pixel is the picture's grey.
  const auto pixel = [&](std::size_t column, std::size_t row, std::size_t channel) {
    return int(truth.picture.pixels[3 * (row * 4 + column) + channel]);
  };
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(pixel(0, 0, k) == (100 + truth.legend[4].colour[k]) / 2);
    CHECK(pixel(1, 0, k) == (100 + truth.legend[1].colour[k]) / 2);
    CHECK(pixel(2, 1, k) == (100 + truth.legend[2].colour[k]) / 2);
    CHECK(pixel(2, 0, k) == (100 + 3 * truth.legend[0].colour[k]) / 4);  // an instance's border
  }
}

TEST_CASE("In ground range a picture has the tints of its columns, and none beyond the range") {
  Waterfall image = small_image();
  image.sonar.range_m = 4.0;
  image.pings[0].altitude_m = 1.5;
  const PictureColumns ground{.over_ground = true, .per_side = 4};
  const Picture grey{4, 2, 1, {100, 120, 140, 160, 180, 200, 220, 240}};
  // The picture as its columns show it: `over` has the bins below in these columns, 0 for none.
  const Picture over{4, 2, 1, {100, 120, 140, 160, 200, 220, 220, 240}};
  const TruthPicture truth = lay_truth(image, over, classes, materials, ground);
  const Picture in_slant_range = lay_truth(image, grey, classes, materials, bin_columns).picture;
  const auto first = [&](std::size_t row) {
    std::vector<double> columns;
    for (const ShownColumns& shown : shown_columns(image, row, ground)) {
      CHECK(shown.until == shown.from + 1.0);
      columns.push_back(shown.from);
    }
    return columns;
  };
  // The top ping has no altitude and its first return in bin 0, so its columns stay.
  CHECK(first(1) == std::vector<double>{0, 1, 2, 3});
  // The other one begins behind its water column, which the legend has from the top ping alone.
  CHECK(first(0) == std::vector<double>{1, 2, 2, 3});
}

TEST_CASE("A column of several bins has the tint of the thing in it, and all of its borders") {
  // One side, eight bins: an object in bin 2, a shadow in bins 3 and 4.
  Sonar sonar;
  sonar.name = "s";
  sonar.sides = Sides::starboard;
  sonar.bins = 8;
  sonar.range_m = 8.0;
  Waterfall image(sonar, 1);
  const auto number = [](Region region) { return static_cast<std::uint32_t>(region); };
  image.pixels.region.assign(8, number(Region::seabed));
  image.pixels.class_id.assign(8, 1);
  image.pixels.sediment.assign(8, 1);
  image.pixels.region[2] = number(Region::object);
  image.pixels.class_id[2] = 2;
  image.pixels.instance[2] = 5;
  for (const std::size_t bin : {3, 4}) {
    image.pixels.region[bin] = number(Region::shadow);
    image.pixels.shadow_instance[bin] = 5;
  }
  const PictureColumns two{.over_ground = false, .per_side = 2};
  const Picture grey{2, 1, 1, {100, 100}};
  const TruthPicture truth = lay_truth(image, grey, classes, materials, two);
  const auto tint = [&](const char* name) {
    return std::ranges::find(truth.legend, name, &LegendEntry::name)->colour;
  };
  REQUIRE(names(truth) == std::vector<std::string>{"mine", "shadow"});
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(int(truth.picture.pixels[k]) == (100 + 3 * tint("mine")[k]) / 4);
    CHECK(int(truth.picture.pixels[3 + k]) == (100 + 3 * tint("shadow")[k]) / 4);
  }
  // The targets of the picture have the same pixels.
  const std::vector<Target> targets = find_targets(truth_in_columns(two, image));
  REQUIRE(targets.size() == 1);
  CHECK(targets[0].body.low == Corner{0, 0});
  CHECK(targets[0].body.high == Corner{1, 1});
  CHECK(targets[0].shadow.low == Corner{1, 0});
  CHECK(targets[0].shadow.high == Corner{2, 1});
}

TEST_CASE("A seabed of one sediment keeps its greys") {
  Waterfall image = small_image();
  image.pixels.sediment = {0, 1, 1, 0, 0, 1, 3, 0};
  const Picture grey{4, 2, 1, {10, 20, 30, 40, 50, 60, 70, 80}};
  const TruthPicture truth = lay_truth(image, grey, classes, materials, bin_columns);
  CHECK(names(truth) == std::vector<std::string>{"mine", "shadow", "water column", "no data"});
  CHECK(truth.picture.pixels[3 * 1] == 20);
  CHECK(truth.picture.pixels[3 * 5] == 60);
}

TEST_CASE("A legend is below its picture, with the number of lines that it needs") {
  TruthPicture truth{{120, 5, 3, std::vector<std::uint8_t>(3 * 120 * 5, 7)}, {}};
  CHECK(with_legend(truth).height == 5);
  truth.legend = {{{255, 0, 0}, "mine"}};
  const Picture one = with_legend(truth);
  CHECK(one.width == 120);
  CHECK(one.height > 12);
  CHECK(std::ranges::equal(truth.picture.pixels, std::span(one.pixels).first(3 * 120 * 5)));
  CHECK(std::ranges::count(one.pixels, 255) > 50);
  truth.legend.push_back({{0, 255, 0}, "a long name of something"});
  CHECK(with_legend(truth).height > one.height);
  const Picture other{3, 2, 1, std::vector<std::uint8_t>(6)};
  CHECK_THROWS_AS(lay_truth(small_image(), other, classes, materials, bin_columns),
                  std::invalid_argument);
}
