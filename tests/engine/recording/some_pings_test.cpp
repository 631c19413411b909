// Selects the pings of a line that have one range and one length.

#include <algorithm>
#include <cstddef>
#include <vector>

#include "support/catch.h"

#include <ensonify/engine/recording/some_pings.h>

using namespace ensonify::engine;

namespace {

struct Kind {
  double range_m;
  std::size_t samples;
};

/// A line of pings of these kinds, whose samples all differ.
RecordedLine line_of_kinds(const std::vector<Kind>& kinds) {
  RecordedLine line;
  for (const Kind& kind : kinds) line.samples = std::max(line.samples, kind.samples);
  for (const Kind& kind : kinds) {
    line.pings.push_back(
        {.number = line.pings.size(), .range_m = kind.range_m, .samples = kind.samples});
    for (std::size_t k = 0; k < line.samples; ++k) {
      line.port.push_back(k < kind.samples ? static_cast<float>(1 + line.port.size()) : 0.0f);
      line.starboard.push_back(-line.port.back());
    }
  }
  return line;
}

std::vector<std::size_t> numbers_of(const RecordedLine& line) {
  std::vector<std::size_t> numbers;
  for (const RecordedPing& ping : line.pings) numbers.push_back(ping.number);
  return numbers;
}

}  // namespace

TEST_CASE("pings of the most frequent range and length are alike, and keep their samples") {
  const Kind near{20.0, 3}, far{30.0, 5}, coarse{30.0, 3};
  const RecordedLine line = line_of_kinds({far, near, coarse, near, far, near, far, near, coarse});
  const auto [alike, left_out] = alike_pings(line);
  CHECK(left_out == "5 of 9 pings have another range or length than most and are left out");
  CHECK(alike.samples == 3);
  REQUIRE(numbers_of(alike) == std::vector<std::size_t>{1, 3, 5, 7});
  for (const Side side : {Side::port, Side::starboard}) {
    REQUIRE(alike.side(side).size() == 4 * 3);
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t k = 0; k < 3; ++k)
        CHECK(alike.row(side, i)[k] == line.row(side, alike.pings[i].number)[k]);
  }
  // Ranges that follow the sound speed of their pings are one range, those 2 % apart are not.
  CHECK(numbers_of(alike_pings(line_of_kinds({{30.0, 3}, {20.1, 3}, {20.0, 3}, {20.5, 3}})).line) ==
        std::vector<std::size_t>{1, 2});
  // The first of two that are equally frequent.
  CHECK(numbers_of(alike_pings(line_of_kinds({far, near, near, far})).line) ==
        std::vector<std::size_t>{0, 3});
}

TEST_CASE("a line of one range and length stays as it is") {
  for (const double range_m : {0.0, 20.0}) {  // 0: not stated, as in pictures
    const RecordedLine line = line_of_kinds({{range_m, 4}, {range_m, 4}, {range_m, 4}});
    const auto [alike, left_out] = alike_pings(line);
    CHECK(left_out.empty());
    CHECK(alike.port == line.port);
    CHECK(alike.pings.size() == 3);
  }
  CHECK(alike_pings({}).line.pings.empty());
}

TEST_CASE("pings that state no range count only if most state none") {
  CHECK(numbers_of(alike_pings(line_of_kinds({{0.0, 4}, {20.0, 4}, {30.0, 4}, {0.0, 4}})).line) ==
        std::vector<std::size_t>{1});
  CHECK(numbers_of(alike_pings(line_of_kinds({{0.0, 4}, {20.0, 4}, {0.0, 4}})).line) ==
        std::vector<std::size_t>{0, 2});
}
