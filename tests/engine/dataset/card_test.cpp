#include <ensonify/engine/dataset/card.h>

#include "support/catch.h"

using ensonify::engine::Card;

TEST_CASE("names with bars and line breaks stay in their cells of a card") {
  Card card;
  card.title = "Two\nlines";
  card.classes = {"a|b", "c\nd"};
  card.sediments = {"sand"};
  card.targets["a|b"]["train"] = 3;
  const std::string text = card.markdown();
  for (const char* line : {"\n# Two lines\n", "\n| a\\|b | train | 3 |\n",
                           "\n| 1 | a\\|b | sand |\n| 2 | c d |  |\n"}) {
    CAPTURE(line, text);
    CHECK(text.find(line) != std::string::npos);
  }
}

TEST_CASE("a card with licences of files does not say that there are no files") {
  Card card;
  CHECK(card.markdown().find("No external files") != std::string::npos);
  card.licences = {"hull.stl: CC BY 4.0"};
  CHECK(card.markdown().find("No external files") == std::string::npos);
}
