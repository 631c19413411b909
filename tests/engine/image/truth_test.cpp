#include <ensonify/engine/image/truth.h>

#include <random>
#include <set>
#include <string>
#include <vector>

#include "support/catch.h"

using namespace ensonify::engine;

namespace {

/// A waterfall from a drawing of its picture: '.' is bed, a digit the body of that object, a letter
/// the shadow of object 1 (a), 2 (b), and so on.
Waterfall drawn(const std::vector<std::string>& picture) {
  Sonar sonar;
  sonar.bins = static_cast<int>(picture.front().size() / 2);
  Waterfall image(sonar, picture.size());
  for (std::size_t row = 0; row < picture.size(); ++row)
    for (std::size_t column = 0; column < picture[row].size(); ++column) {
      const std::size_t i = (picture.size() - 1 - row) * image.columns() + column;
      const char c = picture[row][column];
      const bool body = c >= '1' && c <= '9', shadow = c >= 'a' && c <= 'z';
      image.pixels.region[i] = static_cast<std::uint32_t>(body     ? Region::object
                                                          : shadow ? Region::shadow
                                                                   : Region::seabed);
      if (body) image.pixels.instance[i] = static_cast<std::uint32_t>(c - '0');
      if (shadow) image.pixels.shadow_instance[i] = static_cast<std::uint32_t>(c - 'a' + 1);
      image.pixels.intensity_mean[i] = body ? 40.0f : 4.0f;
      image.pixels.range_m[i] = static_cast<float>(column);
    }
  return image;
}

/// The area of a polygon; positive if it is clockwise in the picture, whose rows count downwards.
int twice_area(const std::vector<Corner>& polygon) {
  int sum = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Corner &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    sum += a[0] * b[1] - b[0] * a[1];
  }
  return sum;
}

/// The pixels that run lengths describe, column by column, each from the top.
std::vector<std::string> unrolled(const std::vector<std::size_t>& runs, std::size_t rows,
                                  std::size_t columns) {
  std::vector<std::string> picture(rows, std::string(columns, '.'));
  std::size_t at = 0;
  for (std::size_t run = 0; run < runs.size(); ++run)
    for (std::size_t i = 0; i < runs[run]; ++i, ++at)
      if (run % 2 == 1) picture.at(at % rows).at(at / rows) = '1';
  REQUIRE(at == rows * columns);
  return picture;
}

}  // namespace

TEST_CASE("A target has box, area and border in the picture's pixels, the newest ping on top") {
  const std::vector<Target> targets = find_targets(drawn({"..........",  //
                                                          ".......11.",  //
                                                          ".......1..",  //
                                                          "..aa......"}));
  REQUIRE(targets.size() == 1);
  const Target& target = targets.front();
  CHECK(target.instance == 1);
  CHECK(target.body.area_px == 3);
  CHECK(target.body.low == Corner{7, 1});
  CHECK(target.body.high == Corner{9, 3});
  REQUIRE(target.body.polygons.size() == 1);
  CHECK(target.body.polygons[0] ==
        std::vector<Corner>{{7, 1}, {9, 1}, {9, 2}, {8, 2}, {8, 3}, {7, 3}});
  CHECK(target.shadow.area_px == 2);
  CHECK(target.shadow.low == Corner{2, 3});
  CHECK(target.shadow.polygons[0] == std::vector<Corner>{{2, 3}, {4, 3}, {4, 4}, {2, 4}});
  CHECK(target.sight.sector() == "starboard");
  CHECK(target.ping == Approx((2.0 + 2.0 + 1.0) / 3.0));  // row 1 of 4 is ping 2
  CHECK(target.range_m == Approx((7.0 + 8.0 + 7.0) / 3.0));
  CHECK(target.contrast_db.value() == Approx(10.0));
}

TEST_CASE("Parts that touch only at a corner are separate, the largest first") {
  const std::vector<Target> targets = find_targets(drawn({"1.........",  //
                                                          ".11.......",  //
                                                          ".11..2...1"}));
  REQUIRE(targets.size() == 2);
  REQUIRE(targets[0].body.polygons.size() == 3);
  CHECK(targets[0].body.polygons[0] == std::vector<Corner>{{1, 1}, {3, 1}, {3, 3}, {1, 3}});
  CHECK(targets[0].body.area_px == 6);
  CHECK(targets[0].body.low == Corner{0, 0});
  CHECK(targets[0].body.high == Corner{10, 3});
  CHECK(targets[1].instance == 2);
}

TEST_CASE("A part with a hole, or with another part in its hole, has run lengths") {
  for (const std::vector<std::string>& picture : {std::vector<std::string>{"11111.",  //
                                                                           "1...1.",  //
                                                                           "11111."},
                                                  std::vector<std::string>{"......",  //
                                                                           ".11111",  //
                                                                           ".1...1",  //
                                                                           ".1.1.1",  //
                                                                           ".1...1",  //
                                                                           ".11111"}}) {
    const Outline body = find_targets(drawn(picture)).at(0).body;
    CHECK(unrolled(body.runs, picture.size(), picture[0].size()) == picture);
  }
  const Target plain = find_targets(drawn({"11..",  //
                                           "1a..",  //
                                           ".aa."}))
                           .at(0);
  CHECK(plain.body.runs.empty());
  CHECK(plain.shadow.runs.empty());
}

TEST_CASE("A polygon has no holes, and a ring that touches itself at a corner is one polygon") {
  const std::vector<Target> ring = find_targets(drawn({"11111.",  //
                                                       "1...1.",  //
                                                       "11111."}));
  REQUIRE(ring[0].body.polygons.size() == 1);
  CHECK(ring[0].body.area_px == 12);
  CHECK(twice_area(ring[0].body.polygons[0]) == 2 * 15);
  const std::vector<Target> pinch = find_targets(drawn({"111...",  //
                                                        "1.1...",  //
                                                        "11.1..",  //
                                                        ".111.."}));
  REQUIRE(pinch[0].body.polygons.size() == 1);
  // The openings of the body are not holes: they connect to the outside over corners.
  CHECK(pinch[0].body.area_px == 11);
  CHECK(twice_area(pinch[0].body.polygons[0]) == 2 * 11);
}

TEST_CASE("The polygons of random pictures enclose the pixels of their parts") {
  std::mt19937 random(3);
  for (int round = 0; round < 200; ++round) {
    std::vector<std::string> picture(9, std::string(14, '.'));
    for (std::string& row : picture)
      for (char& c : row)
        if (random() % 100 < 55) c = random() % 4 ? '1' : 'b';
    for (const Target& target : find_targets(drawn(picture)))
      for (const Outline* outline : {&target.body, &target.shadow}) {
        int area = 0;
        for (const std::vector<Corner>& polygon : outline->polygons) {
          REQUIRE(polygon.size() >= 4);
          REQUIRE(polygon.size() % 2 == 0);
          REQUIRE(twice_area(polygon) > 0);
          area += twice_area(polygon) / 2;
        }
        REQUIRE(area >= static_cast<int>(outline->area_px));
        REQUIRE(outline->runs.empty() == (area == static_cast<int>(outline->area_px)));
        if (!outline->runs.empty()) {
          std::vector<std::string> mine = picture;
          for (std::string& row : mine)
            for (char& c : row) c = c == (outline == &target.body ? '1' : 'b') ? '1' : '.';
          REQUIRE(unrolled(outline->runs, 9, 14) == mine);
        }
        if (outline->polygons.empty()) continue;
        // By the even-odd rule each pixel of the object is inside at least one polygon.
        for (int row = 0; row < 9; ++row)
          for (int column = 0; column < 14; ++column) {
            const char mine = outline == &target.body
                                  ? static_cast<char>('0' + target.instance)
                                  : static_cast<char>('a' + target.instance - 1);
            if (picture[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)] != mine)
              continue;
            bool inside_any = false;
            for (const std::vector<Corner>& polygon : outline->polygons) {
              bool inside = false;
              for (std::size_t i = 0; i < polygon.size(); ++i) {
                const Corner &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
                if (a[0] == b[0] && a[0] > column && std::min(a[1], b[1]) <= row &&
                    std::max(a[1], b[1]) > row)
                  inside = !inside;
              }
              inside_any = inside_any || inside;
            }
            REQUIRE(inside_any);
          }
      }
  }
}

TEST_CASE("A picture without objects has no targets") {
  CHECK(find_targets(drawn({"....", "...."})).empty());
}

TEST_CASE("A target is at a line's edge with a pixel of its body at an end or at the full range") {
  const std::vector<std::string> picture{".1..2aaa",  //
                                         "........",  //
                                         "...33..4",  //
                                         "5.......",  //
                                         "bbbb6666",  //
                                         "..7.77..", "........"};
  using Found = std::set<std::uint32_t>;
  CHECK(targets_at_edges(drawn(picture)) == Found{1, 2, 4, 5, 6});
  // If the image has one side only, the other end of a row is below the sonar.
  Waterfall one_side = drawn(picture);
  one_side.sonar.bins *= 2;
  one_side.sonar.sides = Sides::port;
  CHECK(targets_at_edges(one_side) == Found{1, 2, 5});
  one_side.sonar.sides = Sides::starboard;
  CHECK(targets_at_edges(one_side) == Found{1, 2, 4, 6});
}
