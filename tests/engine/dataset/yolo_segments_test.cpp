#include <random>
#include <sstream>

#include "support/catch.h"

#include <ensonify/engine/dataset/yolo_segments.h>

using namespace ensonify::engine;

namespace {

/// Whether a point is inside a polygon by the even-odd rule.
bool inside(const std::vector<double>& xy, double x, double y) {
  bool odd = false;
  for (std::size_t i = 0, j = xy.size() - 2; i < xy.size(); j = i, i += 2)
    if ((xy[i + 1] > y) != (xy[j + 1] > y) &&
        x < xy[i] + (xy[j] - xy[i]) * (y - xy[i + 1]) / (xy[j + 1] - xy[i + 1]))
      odd = !odd;
  return odd;
}

}  // namespace

TEST_CASE("a segment is one polygon that covers a mask's pixels, with several parts and holes") {
  std::mt19937 random(3);
  constexpr std::size_t columns = 11, rows = 8;
  for (int round = 0; round < 50; ++round) {
    std::vector<bool> mask(columns * rows);  // column by column
    for (auto pixel : mask) pixel = random() % 100 < 60;
    std::vector<std::size_t> runs{0};
    bool set = false;
    for (const bool pixel : mask) {
      if (pixel != set) runs.push_back(0), set = pixel;
      ++runs.back();
    }
    const std::string text = yolo_segment(4, loops_of(runs, rows), columns, rows);
    REQUIRE(text.ends_with("\n"));
    std::istringstream words(text);
    int class_number = -1;
    words >> class_number;
    CHECK(class_number == 4);
    std::vector<double> xy;
    for (double value = 0; words >> value;) xy.push_back(value);
    std::size_t wrong = 0;
    for (std::size_t column = 0; column < columns; ++column)
      for (std::size_t row = 0; row < rows; ++row)
        // Not on the lines that join the parts.
        wrong += inside(xy, (double(column) + 0.5123) / columns, (double(row) + 0.4717) / rows) !=
                 mask[column * rows + row];
    CHECK(wrong == 0);
  }
  CHECK(yolo_segment(0, loops_of(std::vector<std::size_t>{6}, 3), 2, 3).empty());
  CHECK(yolo_segment(0, loops_of(std::vector<std::size_t>{1, 1, 2, 1, 1}, 3), 2, 3) ==
        "0 0.000000 0.333333 1.000000 0.333333 1.000000 0.666667 0.000000 0.666667\n");
}
