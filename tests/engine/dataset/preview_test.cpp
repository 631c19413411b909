#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include "support/catch.h"
#include "support/temporary_folder.h"
#include "support/tiny_recipe.h"

#include <ensonify/engine/dataset/preview.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

using Rgb = std::array<std::uint8_t, 3>;

Rgb colour_of(const Picture& picture, std::size_t column, std::size_t row) {
  const std::size_t i = 3 * (row * picture.width + column);
  return {picture.pixels[i], picture.pixels[i + 1], picture.pixels[i + 2]};
}

bool is_grey(const Rgb& colour) {
  return *std::ranges::max_element(colour) - *std::ranges::min_element(colour) < 8;
}

}  // namespace

TEST_CASE("a contact sheet has the line to scale, with a closed box around its object") {
  // One object is to starboard, and the picture is grey.
  std::string text =
      tests::changed(tests::tiny_recipe, "[display]\n", "[display]\npalette = \"grey\"\n");
  text = tests::changed(text, "samples = 8\nseafloors = 4\nrenders = 2\n", "samples = 1\n");
  const tests::TemporaryFolder folder;
  const ContactSheet sheet =
      preview(Recipe(text, "r.toml", {}), 5, {.threads = 1, .scratch = folder.path()});
  CHECK(sheet.samples == 1);
  const Picture& picture = sheet.picture;

  // The panel with the line is as wide as two sides of 12 m; its 16 pings, 0.5 m apart, are 7.5 m.
  constexpr std::size_t panel_width = 380, border = 6;
  const Rgb paper = colour_of(picture, 0, 0);
  std::size_t top = picture.height, bottom = 0;
  for (std::size_t row = 0; row < picture.height; ++row) {
    std::size_t of_panel = 0;
    for (std::size_t column = border; column < border + panel_width; ++column)
      of_panel += colour_of(picture, column, row) != paper;
    if (of_panel < panel_width) continue;
    top = std::min(top, row);
    bottom = row + 1;
  }
  CHECK(bottom - top == std::size_t(panel_width * 7.5 / 24.0));

  // The box and the word next to it are the only colours.
  std::optional<std::array<std::size_t, 2>> corner;
  for (std::size_t row = top; row < bottom && !corner; ++row)
    for (std::size_t column = border; column < border + panel_width && !corner; ++column)
      if (!is_grey(colour_of(picture, column, row))) corner = {column, row};
  REQUIRE(corner);
  const auto [left, first_row] = *corner;
  const Rgb colour = colour_of(picture, left, first_row);
  const auto drawn = [&](std::size_t column, std::size_t row) {
    return colour_of(picture, column, row) == colour;
  };
  std::size_t right = left, last_row = first_row;
  while (drawn(right + 1, first_row)) ++right;
  while (drawn(left, last_row + 1)) ++last_row;
  CHECK(right > left + 3);
  CHECK(last_row > first_row + 3);
  CHECK(left > border + panel_width / 2);
  std::size_t missing = 0;
  for (std::size_t row = first_row; row <= last_row; ++row) missing += !drawn(right, row);
  for (std::size_t column = left; column <= right; ++column) missing += !drawn(column, last_row);
  CHECK(missing == 0);
  CHECK(!drawn(left + 1, first_row + 1));
}

TEST_CASE("the caption of a sample has drawn lists, too") {
  std::string text =
      tests::changed(tests::tiny_recipe, "elevations = 160\n",
                     "elevations = 160\nfocus_zones_m = { choice = [[5.5, 7.25]] }\n");
  text = tests::changed(text, "samples = 8\nseafloors = 4\nrenders = 2\n", "samples = 1\n");
  const tests::TemporaryFolder folder;
  CHECK(preview(Recipe(text, "r.toml", {}), 1, {.threads = 1, .scratch = folder.path()}).samples ==
        1);
}
