#include <ensonify/scatter/kind_named.h>

#include <array>
#include <stdexcept>
#include <string>

#include "support/catch.h"

using namespace ensonify::scatter;

namespace {

struct Kind {
  std::string_view name;
  int number;
};
constexpr std::array kinds{Kind{"box-tree", 1}, Kind{"flat_list", 2}};

}  // namespace

TEST_CASE("A kind is found by its name, with - or _") {
  for (const char* name : {"box-tree", "box_tree"})
    CHECK(kind_named(kinds, "kind", name).number == 1);
  for (const char* name : {"flat-list", "flat_list"})
    CHECK(kind_named(kinds, "kind", name).number == 2);
}

TEST_CASE("The message for an unknown kind lists the names, and shortens a long one") {
  CHECK_THROWS_WITH(kind_named(kinds, "kind", "boxtree"),
                    "there is no kind 'boxtree'; there are: box-tree, flat_list");
  CHECK_THROWS_AS(kind_named(kinds, "kind", ""), std::invalid_argument);
  CHECK_THROWS_WITH(
      kind_named(kinds, "kind", std::string(1000, 'x')),
      "there is no kind '" + std::string(64, 'x') + "'; there are: box-tree, flat_list");
}
