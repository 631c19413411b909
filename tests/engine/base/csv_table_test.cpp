#include <ensonify/engine/base/csv_table.h>

#include <array>
#include <cmath>

#include "support/catch.h"

using namespace ensonify::engine;

// What rows and damaged text may be is in profile_reader_test.cpp, through this same table.

namespace {
constexpr std::array<CsvColumn, 3> columns = {{{"angle_deg"}, {"a", false}, {"b", false}}};

CsvTable parsed(std::string_view text) {
  return CsvTable::parse(text, "t.csv", {.row = "level", .columns = columns});
}
}  // namespace

TEST_CASE("A CSV table has the columns that are there, in the order they are asked for") {
  const CsvTable table = parsed("# of today\nb,note,angle_deg\n1,x,2\n\n3,,-4.5e1\n");
  REQUIRE(table.rows() == 2);
  CHECK(table.has(0));
  CHECK_FALSE(table.has(1));
  CHECK(table.has(2));
  CHECK(table.at(0, 0) == 2.0);
  CHECK(table.at(0, 2) == 1.0);
  CHECK(table.at(1, 0) == -45.0);
  CHECK(table.at(1, 2) == 3.0);
}

TEST_CASE("A field of a CSV table is empty only where its column allows it") {
  constexpr std::array<CsvColumn, 2> may{{{"a"}, {.name = "b", .may_be_empty = true}}};
  const CsvTable table = CsvTable::parse("a,b\n1,\n2,3\n", "t.csv", {.row = "row", .columns = may});
  CHECK(std::isnan(table.at(0, 1)));
  CHECK(table.at(1, 1) == 3.0);
  CHECK_THROWS_WITH(CsvTable::parse("a,b\n,3\n", "t.csv", {.row = "row", .columns = may}),
                    "t.csv:2: a is '', expected a number such as 12.5");
}

TEST_CASE("A CSV table has infinite numbers and no rows only where its format allows it") {
  constexpr std::array<CsvColumn, 2> may{{{"a"}, {.name = "b", .may_be_infinite = true}}};
  const CsvFormat format{.row = "row", .columns = may, .may_have_no_rows = true};
  CHECK(CsvTable::parse("a,b\n", "t.csv", format).rows() == 0);
  CHECK(std::isinf(CsvTable::parse("a,b\n1,inf\n", "t.csv", format).at(0, 1)));
  for (const char* text : {"a,b\ninf,1\n", "a,b\n1,nan\n", "a,b\n1,1e999\n"})
    CHECK_THROWS_WITH(CsvTable::parse(text, "t.csv", format),
                      Catch::Contains("expected a number such as 12.5"));
}

TEST_CASE("A quoted field of a CSV table may have commas and quotes, and lines may end with CR") {
  const CsvTable quoted = parsed(
      "\"note, of the \"\"day\"\"\",angle_deg, \"b\" \n\"a,b\",1,2\n\"\",\"3\",4\n\"\"\",\"\"\",5,6\n");
  REQUIRE(quoted.rows() == 3);
  CHECK(quoted.at(0, 0) == 1.0);
  CHECK(quoted.at(0, 2) == 2.0);
  CHECK(quoted.at(1, 0) == 3.0);
  CHECK(quoted.at(2, 2) == 6.0);
  const CsvTable with_cr = parsed("angle_deg,a\r1,2\r\r3,4\r");
  REQUIRE(with_cr.rows() == 2);
  CHECK(with_cr.at(1, 1) == 4.0);
  CHECK(std::string(with_cr.fault(1, "too large").what()) == "t.csv:4: too large");
  CHECK(std::string(parsed("angle_deg\r\n\r\n1\r\n").fault(0, "too large").what()) ==
        "t.csv:3: too large");
}

TEST_CASE("A CSV table of other separators is refused with their name") {
  CHECK_THROWS_WITH(
      parsed("angle_deg;a\n0,5;1\n"),
      "t.csv:1: the columns are separated by semicolons, expected commas, and decimal "
      "points");
  CHECK_THROWS_WITH(parsed("angle_deg\ta\n1\t2\n"), Catch::Contains("separated by tabs"));
}

TEST_CASE("Errors of a CSV table name file and line, and the columns that are optional") {
  CHECK(std::string(parsed("angle_deg\n\n1\n2\n").fault(1, "too large").what()) ==
        "t.csv:4: too large");
  CHECK_THROWS_WITH(parsed("a,b\n1,2\n"),
                    "t.csv:1: no column angle_deg in 'a,b', expected a header row with "
                    "angle_deg[,a][,b]");
  CHECK_THROWS_WITH(parsed("angle_deg\n"),
                    "t.csv:1: no level follows the header row, expected at least one");
  CHECK_THROWS_WITH(parsed("angle_deg,b,b\n1,2,3\n"), Catch::Contains("b appears twice"));
}
