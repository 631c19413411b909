#include <string>

#include <fmt/format.h>

#include "support/catch.h"
#include "support/recipes.h"

#include <ensonify/engine/base/scene_error.h>
#include <ensonify/engine/dataset/piece_sizes.h>

using namespace ensonify::engine;
using namespace ensonify::tests;

TEST_CASE("tiles and chips that are larger than the line are refused where the scene shows it") {
  const auto recipe = [](const std::string& pieces, const std::string& more = "") {
    return "[dataset]\nsamples = 2\n" + pieces + "[track]\npings = 30\n" + more +
           "[sonar.s]\nbins = 50\nrange_m = 20\nbeams = 2\n";
  };
  const auto tiles = [](int columns, int rows) {
    return fmt::format("[dataset.tiles]\nwidth_px = {}\nheight_px = {}\n", columns, rows);
  };
  // Two sides of 50 bins, 30 pings of two beams.
  CHECK_NOTHROW(recipe_of(recipe(tiles(100, 60))));
  check_refused(recipe(tiles(101, 60)),
                "r.toml: 'dataset.tiles' needs 101 x 60 pixels, but s has 100 x 60; make the tiles "
                "or chips smaller or the line longer");
  check_refused(recipe(tiles(100, 61)), "'dataset.tiles' needs 100 x 61 pixels");
  CHECK_NOTHROW(recipe_of(recipe("[dataset.chips]\nsize_px = 60\n")));
  check_refused(recipe("[dataset.chips]\nsize_px = 61\n"),
                "'dataset.chips' needs 61 x 61 pixels, but s has 100 x 60");
  // A size that follows from the target always fits.
  CHECK_NOTHROW(recipe_of(recipe("[dataset.chips]\nsize_px = 500\nmargin = [0.2]\n")));
  // One sample may have a line that is long enough.
  const Recipe some = recipe_of(
      "[dataset]\nsamples = 8\n[dataset.chips]\nsize_px = 40\n[track]\n"
      "pings = { choice = [30, 50], stratified = true }\n[sonar.s]\nbins = 50\n");
  int refused = 0;
  for (std::size_t i = 0; i < some.samples(); ++i) try {
      const SampleScene sample = some.sample(i);
      CHECK(sample.scene.track.pings == 50);
    } catch (const SceneError& error) {
      CHECK_THAT(error.what(), Catch::Contains("but s has 100 x 30;") &&
                                   Catch::EndsWith(fmt::format("(sample {})", i)));
      ++refused;
    }
  CHECK(refused == 4);
  // Lengths along the track follow from the time between pings: 29 steps of 0.5 m, and two rows
  // per ping 0.25 m apart.
  const std::string known = "ping_interval_s = 0.25\nspeed_mps = 2\n",
                    beam = "beam_spacing_m = 0.25\n";
  const auto in_metres = [](double width_m, double height_m) {
    return fmt::format("[dataset.tiles]\nwidth_m = {}\nheight_m = {}\n", width_m, height_m);
  };
  const auto ground = [](int columns, int rows) {
    return fmt::format(
        "slant = false\nground_px_m = 0.3\n[dataset.tiles]\nwidth_px = {}\nheight_px = {}\n",
        columns, rows);
  };
  CHECK_NOTHROW(recipe_of(recipe(in_metres(40.0, 15.0), known) + beam));
  check_refused(recipe(in_metres(40.0, 15.2), known) + beam, "needs 100 x 61 pixels");
  check_refused(recipe(in_metres(40.5, 15.0), known) + beam, "needs 101 x 60 pixels");
  CHECK_NOTHROW(recipe_of(recipe(in_metres(400.0, 150.0))));  // only its seabed tells
  // 20 m and 14.75 m in pixels of 0.3 m.
  CHECK_NOTHROW(recipe_of(recipe(ground(132, 50), known) + beam));
  check_refused(recipe(ground(132, 51), known) + beam, "but s_ground has 132 x 50;");
  check_refused(recipe(ground(133, 50), known) + beam, "but s_ground has 132 x 50;");
}

TEST_CASE("chips that are smaller than their objects are counted before any is made") {
  // Bins of 0.4 m, and pings 0.4 m apart.
  const auto forecast = [](const std::string& chips, const std::string& object) {
    const Recipe recipe =
        recipe_of("[dataset]\nsamples = 2\n[dataset.chips]\n" + chips + "[[objects]]\n" + object +
                  "class = \"mine\"\n[track]\npings = 60\nping_interval_s = 0.2\nspeed_mps = 2\n" +
                  "[sonar.s]\nbins = 50\nrange_m = 20\n");
    const ChipForecast found = forecast_chips(recipe.options(), recipe.sample(0).scene);
    return std::pair(found.chips, found.without_target);
  };
  using Found = std::pair<std::size_t, std::size_t>;
  const auto box = [](double length_m, double width_m, const std::string& more = "") {
    return fmt::format("shape = \"box\"\nlength_m = {}\nwidth_m = {}\n", length_m, width_m) + more;
  };
  // Chips of 4 m x 4 m: a quarter of 8 m x 8 m, a fifth of 20 m x 1 m.
  CHECK(forecast("size_px = 10\n", box(3, 3)) == Found{1, 0});
  CHECK(forecast("size_px = 10\n", box(7.9, 7.9)) == Found{1, 0});
  CHECK(forecast("size_px = 10\n", box(9, 9)) == Found{1, 1});
  CHECK(forecast("size_px = 10\n", box(20, 1)) == Found{1, 1});
  CHECK(forecast("size_px = 10\n", box(20, 1, "count = 3\n")) == Found{3, 3});
  // Across the diagonal, a chip shows more of it: 5.7 m of 20 m.
  CHECK(forecast("size_px = 10\n", box(20, 0.1, "heading_deg = 45\n")) == Found{1, 0});
  CHECK(forecast("size_m = 6\n", box(20, 1)) == Found{1, 0});
  CHECK(forecast("size_px = 10\nclasses = [\"mine\"]\n", box(20, 1)) == Found{1, 1});
  // Chips whose size follows from the target show it.
  CHECK(forecast("size_px = 10\nmargin = [0.1]\n", box(20, 1)) == Found{0, 0});
}
