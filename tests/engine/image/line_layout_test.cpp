#include <iterator>
#include <vector>

#include "support/catch.h"

#include <ensonify/engine/image/line_layout.h>

using namespace ensonify::engine;

TEST_CASE("the columns of a row are port from far to near, then starboard from near to far") {
  const LineLayout both(Sides::both, 3);
  REQUIRE(both.columns() == 6);
  std::vector<std::size_t> sectors, bins;
  for (std::size_t column = 0; column < both.columns(); ++column) {
    sectors.push_back(both.place(column).sector);
    bins.push_back(both.place(column).bin);
  }
  CHECK(sectors == std::vector<std::size_t>{0, 0, 0, 1, 1, 1});
  CHECK(bins == std::vector<std::size_t>{2, 1, 0, 0, 1, 2});
}

TEST_CASE("a sonar with one side has the columns of that side alone") {
  const LineLayout port(Sides::port, 3), starboard(Sides::starboard, 3);
  CHECK(port.columns() == 3);
  CHECK(port.place(0).bin == 2);
  CHECK(port.mirrored(0));
  CHECK(starboard.columns() == 3);
  CHECK(starboard.place(0).bin == 0);
  CHECK_FALSE(starboard.mirrored(0));
}

TEST_CASE("the column of a place has that place, and a line that was set is got again") {
  for (const Sides sides : {Sides::both, Sides::port, Sides::starboard}) {
    const LineLayout layout(sides, 5);
    for (std::size_t column = 0; column < layout.columns(); ++column)
      CHECK(layout.column(layout.place(column)) == column);
    std::vector<int> row(layout.columns(), -1);
    for (std::size_t sector = 0; sector < layout.sectors(); ++sector) {
      std::vector<int> line;
      for (int bin = 0; bin < 5; ++bin) line.push_back(10 * static_cast<int>(sector) + bin);
      layout.set(sector, line, row.begin());
      for (std::size_t bin = 0; bin < 5; ++bin)
        CHECK(row[layout.column({sector, bin})] == line[bin]);
      std::vector<int> again;
      layout.get(sector, row.begin(), std::back_inserter(again));
      CHECK(again == line);
    }
  }
}
