#include <algorithm>
#include <cmath>
#include <set>
#include <span>

#include <fmt/format.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/paths.h"
#include "support/recipes.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/dataset/distribution.h>
#include <ensonify/engine/dataset/recipe.h>
#include <ensonify/engine/scene/dump.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/seafloor/analysis.h>
#include <ensonify/engine/simulator/prepare.h>

using namespace ensonify::engine;
using namespace ensonify::tests;

TEST_CASE("a sample's draws depend on the recipe's seed, the key and the number alone") {
  const std::string draws =
      "[track]\naltitude_m = { uniform = [3, 12] }\nspeed_mps = { uniform = [1, 2] }\n";
  const Recipe few = recipe_of("seed = 5\n[dataset]\nsamples = 3\n" + draws);
  const Recipe many = recipe_of("seed = 5\n[dataset]\nsamples = 30\n" + draws +
                                "climb_mps = { uniform = [1, 2] }\n");
  std::set<double> altitudes;
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(few.sample(i).scene.track.altitude_m == many.sample(i).scene.track.altitude_m);
    CHECK(few.sample(i).scene.seed == many.sample(i).scene.seed);
    altitudes.insert(few.sample(i).scene.track.altitude_m);
  }
  CHECK(altitudes.size() == 3);
  const Recipe other = recipe_of("seed = 6\n[dataset]\nsamples = 3\n" + draws);
  CHECK(other.sample(0).scene.track.altitude_m != few.sample(0).scene.track.altitude_m);
}

TEST_CASE("seed 0 is a seed like any other") {
  const std::string rest = "[dataset]\nsamples = 2\n[track]\naltitude_m = { uniform = [3, 12] }\n";
  const double zero = recipe_of("seed = 0\n" + rest).sample(0).scene.track.altitude_m;
  CHECK(zero == recipe_of("seed = 0\n" + rest).sample(0).scene.track.altitude_m);
  CHECK(zero != recipe_of("seed = 1\n" + rest).sample(0).scene.track.altitude_m);
}

TEST_CASE("distributions have the shapes that they are named after") {
  const Recipe recipe = recipe_of(R"(
[dataset]
samples = 2000
[draw]
a = { uniform = [2, 6] }
b = { log_uniform = [1, 100] }
c = { normal = [10, 2] }
d = { normal = [10, 2], between = [9, 12] }
e = { int = [3, 5] }
f = { choice = ["x", "y"], weights = [3, 1] }
)");
  const auto numbers = [&](const std::string& key) {
    std::vector<double> all;
    for (std::size_t i = 0; i < recipe.samples(); ++i)
      all.push_back(std::stod(recipe.sample(i).drawn.at(key)));
    std::ranges::sort(all);
    return all;
  };
  const auto mean = [](const std::vector<double>& all) {
    double sum = 0;
    for (const double x : all) sum += x;
    return sum / double(all.size());
  };
  // Five standard errors of each.
  const auto a = numbers("draw.a");
  CHECK((a.front() >= 2 && a.back() <= 6));
  CHECK(mean(a) == Approx(4.0).margin(5 * 4 / std::sqrt(12.0 * 2000)));
  const auto b = numbers("draw.b");
  CHECK((b.front() >= 1 && b.back() <= 100));
  CHECK(b[1000] == Approx(10.0).epsilon(0.3));
  const auto c = numbers("draw.c");
  CHECK(mean(c) == Approx(10.0).margin(5 * 2 / std::sqrt(2000.0)));
  CHECK(c[1682] == Approx(12.0).margin(0.5));  // mean and deviation
  const auto d = numbers("draw.d");
  CHECK((d.front() >= 9 && d.back() <= 12));
  const auto e = numbers("draw.e");
  CHECK((e.front() == 3 && e.back() == 5));
  CHECK(std::ranges::count(e, 4.0) == Approx(667).margin(110));
  int x = 0;
  for (std::size_t i = 0; i < recipe.samples(); ++i)
    x += recipe.sample(i).drawn.at("draw.f") == "\"x\"";
  CHECK(x == Approx(1500).margin(100));
}

TEST_CASE("a normal distribution is drawn within a range exactly if it reaches it often enough") {
  const auto recipe = [](double least) {
    return recipe_of(fmt::format(
        "[dataset]\nsamples = 300\n[draw]\nx = {{ normal = [5, 1], between = [{}, 10] }}\n",
        least));
  };
  // Above 3 standard deviations lie 1.35 of 1000 draws: each sample has one of them.
  const Recipe rare = recipe(8.0);
  double sum = 0.0;
  for (std::size_t i = 0; i < rare.samples(); ++i) {
    const double x = std::stod(rare.sample(i).drawn.at("draw.x"));
    CHECK((x >= 8.0 && x <= 10.0));
    sum += x;
  }
  // The density at 3 over the share above it; five standard errors.
  CHECK(sum / 300.0 == Approx(5.0 + 3.2831).margin(5.0 * 0.27 / std::sqrt(300.0)));
  // Above 3.2: 0.69 of 1000.
  CHECK_THROWS_WITH(recipe(8.2), Catch::Contains("r.toml:5:5: 'draw.x': hardly any draw lies "
                                                 "between 8.2 and 10, expected a share of 0.001"));
  const std::string begin = "[dataset]\n[draw]\nx = { normal = ";
  check_refused(begin + "[5, 1], between = [90, 100] }\n", "hardly any draw");
  check_refused(begin + "[5, 0], between = [6, 7] }\n", "hardly any draw");
  CHECK(recipe_of(begin + "[5, 0], between = [5, 7] }\n").sample(0).drawn.at("draw.x") == "5");
}

TEST_CASE("stratified draws fill each part of their range, and keys are not tied together") {
  std::string text = "[dataset]\nsamples = 256\n[draw]\n";
  for (int k = 0; k < 12; ++k)
    text += fmt::format("s{} = {{ uniform = [0, 1], stratified = true }}\n", k);
  const Recipe recipe = recipe_of(text);
  std::vector<std::vector<double>> drawn(12);
  for (std::size_t i = 0; i < recipe.samples(); ++i) {
    const SampleScene sample = recipe.sample(i);
    for (std::size_t k = 0; k < drawn.size(); ++k)
      drawn[k].push_back(std::stod(sample.drawn.at(fmt::format("draw.s{}", k))));
  }
  const auto mean_product = [](std::span<const double> a, std::span<const double> b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - 0.5) * (b[i] - 0.5);
    return sum / static_cast<double>(a.size());
  };
  for (std::size_t k = 0; k < drawn.size(); ++k) {
    CAPTURE(k);
    // One in each of as many parts as there are, of all and of the first ones.
    for (const std::size_t count : {8u, 32u, 256u}) {
      std::set<int> parts;
      for (std::size_t i = 0; i < count; ++i)
        parts.insert(static_cast<int>(std::ceil(drawn[k][i] * static_cast<double>(count))));
      CHECK(parts.size() == count);
    }
    // The correlation of independent numbers has a standard deviation of 1/16.
    for (std::size_t other = 0; other < k; ++other)
      CHECK(std::abs(12.0 * mean_product(drawn[k], drawn[other])) < 4.0 / 16.0);
  }
}

TEST_CASE("every split has all values of a stratified choice") {
  const Recipe recipe = recipe_of(R"(
[dataset]
samples = 64
[dataset.split]
train = 2
val = 1
test = 1
[draw]
a = { choice = ["p", "q", "r", "s"], stratified = true }
)");
  std::map<std::string, std::set<std::string>> values;
  for (std::size_t i = 0; i < recipe.samples(); ++i) {
    const SampleScene sample = recipe.sample(i);
    values[sample.split].insert(sample.drawn.at("draw.a"));
  }
  CHECK(values.size() == 3);
  for (const auto& [split, of] : values) CHECK(of.size() == 4);
}

TEST_CASE("keys depend on each other: times, plus, tables, absent tables") {
  const Recipe recipe = recipe_of(R"(
[dataset]
samples = 40
[draw]
side = { choice = [-1, 1] }
kind = { choice = ["mine", "stone"] }
[seafloor]
material = { choice = ["medium sand", "sandy mud"] }
[seafloor.fractal]
height_at_1m_m = { by = "seafloor.material", table = { "medium sand" = 0.02, "sandy mud" = { uniform = [0.001, 0.002] } } }
[[objects]]
present = { by = "draw.kind", table = { mine = true, stone = false } }
shape = "cylinder"
class = "mine"
[[objects]]
shape = "boulder"
class = "stone"
east_m = { times = ["sonar.main.range_m", "draw.side"], uniform = [0.3, 0.8] }
north_m = { plus = "track.speed_mps" }
[track]
speed_mps = 1.5
altitude_m = { times = "sonar.main.range_m", uniform = [0.08, 0.15] }
[sonar.main]
range_m = { uniform = [20, 60] }
)");
  bool with_mine = false, without = false;
  for (std::size_t i = 0; i < recipe.samples(); ++i) {
    const SampleScene sample = recipe.sample(i);
    const Scene& scene = sample.scene;
    const double range_m = scene.sonars.front().range_m;
    CHECK(scene.track.altitude_m / range_m >= 0.08);
    CHECK(scene.track.altitude_m / range_m <= 0.15);
    const ObjectOptions& stone = scene.objects.back();
    CHECK(stone.shape == "boulder");
    CHECK(std::abs(stone.east_m) / range_m >= 0.3 - 1e-9);
    CHECK(std::abs(stone.east_m) / range_m <= 0.8 + 1e-9);
    CHECK((stone.east_m < 0) == (sample.drawn.at("draw.side") == "-1"));
    CHECK(stone.north_m == 1.5);
    const bool mine = sample.drawn.at("draw.kind") == "\"mine\"";
    CHECK(scene.objects.size() == (mine ? 2u : 1u));
    (mine ? with_mine : without) = true;
    const double height_m = scene.seafloor.fractal.height_at_1m_m;
    CHECK((scene.seafloor.material == "medium sand" ? height_m == 0.02
                                                    : height_m >= 0.001 && height_m <= 0.002));
    // The sample's scene can be written and read again.
    CHECK(dump_scene(parse_scene(dump_scene(scene, false), "again"), false) ==
          dump_scene(scene, false));
  }
  CHECK((with_mine && without));
  CHECK(recipe.class_names() == std::vector<std::string>{"mine", "stone", "seabed"});
  CHECK(recipe.target_classes() == 2);
  CHECK(recipe.material_names() ==
        std::vector<std::string>{"fouled steel", "medium sand", "sandy mud"});
}

TEST_CASE("samples that share a seafloor share all that makes it, and nothing else") {
  const Recipe recipe = recipe_of(R"(
[dataset]
samples = 12
seafloors = 3
[seafloor]
depth_m = { uniform = [10, 30] }
cell_m = { by = "seafloor.material", table = { "medium sand" = { by = "objects.0.shape", table = { box = { uniform = [0.3, 0.6] } } } } }
material = "medium sand"
[[objects]]
shape = "box"
east_m = { times = "sonar.main.range_m", uniform = [0.2, 0.6] }
[track]
altitude_m = { uniform = [3, 9] }
[sonar.main]
range_m = { uniform = [20, 60] }
bins = { int = [100, 200] }
)");
  std::set<double> depths, altitudes;
  for (std::size_t i = 0; i < 12; ++i) {
    const SampleScene sample = recipe.sample(i), first = recipe.sample(i / 4 * 4);
    CHECK(sample.seafloor == i / 4);
    CHECK(sample.scene.seafloor.depth_m == first.scene.seafloor.depth_m);
    CHECK(sample.scene.seafloor.cell_m == first.scene.seafloor.cell_m);  // of a table in a table
    CHECK(sample.scene.objects.front().east_m == first.scene.objects.front().east_m);
    CHECK(sample.scene.bed_seed() == first.scene.bed_seed());
    CHECK((i % 4 == 0 || sample.scene.seed != first.scene.seed));
    depths.insert(sample.scene.seafloor.depth_m);
    altitudes.insert(sample.scene.track.altitude_m);
    CHECK(sample.split == first.split);
  }
  CHECK(depths.size() == 3);
  CHECK(altitudes.size() == 12);
}

TEST_CASE("splits have their shares, and held-out values are only in their set") {
  const Recipe even =
      recipe_of("[dataset]\nsamples = 100\n[dataset.split]\ntrain = 6\nval = 2\ntest = 2\n");
  std::map<std::string, int> counts;
  for (std::size_t i = 0; i < 100; ++i) ++counts[even.sample(i).split];
  CHECK(std::abs(counts["train"] - 60) <= 3);
  CHECK(std::abs(counts["val"] - 20) <= 3);

  const Recipe held = recipe_of(R"(
[dataset]
samples = 60
[dataset.split]
by = "draw.site"
held_out_test = ["har*"]
held_out_val = ["bay"]
[draw]
site = { choice = ["harbour", "bay", "fjord", "bank"] }
)");
  for (std::size_t i = 0; i < 60; ++i) {
    const SampleScene sample = held.sample(i);
    const std::string& site = sample.drawn.at("draw.site");
    CHECK(sample.split == (site == "\"harbour\"" ? "test" : site == "\"bay\"" ? "val" : "train"));
  }
}

TEST_CASE("a split by seabed and another key divides the seabeds and holds values of the key out") {
  const std::string rest = R"(
held_out_test = ["cone"]
train = 1
val = 1
[[objects]]
shape = { choice = ["cone", "wedge", "box"] }
)";
  const Recipe recipe = recipe_of(
      "[dataset]\nsamples = 120\nseafloors = 60\n[dataset.split]\nby = [\"seafloor\", "
      "\"objects.0.shape\"]" +
      rest);
  std::map<std::string, std::set<std::size_t>> seafloors;
  std::map<std::string, std::set<std::string>> shapes;
  for (std::size_t i = 0; i < recipe.samples(); ++i) {
    const SampleScene sample = recipe.sample(i);
    seafloors[sample.split].insert(sample.seafloor);
    shapes[sample.split].insert(sample.scene.objects.front().shape);
  }
  CHECK(shapes["test"] == std::set<std::string>{"cone"});
  CHECK(shapes["train"] == std::set<std::string>{"box", "wedge"});
  CHECK(shapes["val"] == std::set<std::string>{"box", "wedge"});
  CHECK(seafloors["train"].size() + seafloors["val"].size() + seafloors["test"].size() == 60);
  CHECK(std::abs(int(seafloors["train"].size()) - int(seafloors["val"].size())) <= 6);

  // Samples that agree in all keys stay together.
  const Recipe pairs = recipe_of(
      "[dataset]\nsamples = 200\n[dataset.split]\nby = [\"draw.site\", \"draw.year\"]\n"
      "[draw]\nsite = { choice = [\"a\", \"b\", \"c\"] }\nyear = { choice = [1, 2, 3] }\n");
  std::map<std::pair<std::string, std::string>, std::set<std::string>> splits;
  for (std::size_t i = 0; i < 200; ++i) {
    const SampleScene sample = pairs.sample(i);
    splits[{sample.drawn.at("draw.site"), sample.drawn.at("draw.year")}].insert(sample.split);
  }
  CHECK(splits.size() == 9);
  for (const auto& [pair, names] : splits) CHECK(names.size() == 1);

  check_refused("[dataset]\n[dataset.split]\nby = \"seafloor\"" + rest, "has held_out values");
  check_refused("[dataset]\n[dataset.split]\nby = []\n", "'dataset.split.by' is empty");
  // A value in two sets.
  for (const auto& [val, test] : {std::pair("bay", "bay"), {"b*", "bay"}, {"bay", "b*"}})
    check_refused(fmt::format("[dataset]\n[dataset.split]\nby = \"draw.site\"\n"
                              "held_out_val = [\"fjord\", \"{}\"]\nheld_out_test = [\"{}\"]\n"
                              "[draw]\nsite = {{ choice = [\"bay\", \"fjord\"] }}\n",
                              val, test),
                  fmt::format("r.toml: 'dataset.split' has \"{}\" in held_out_val and \"{}\" in "
                              "held_out_test",
                              val, test));
}

TEST_CASE("a held-out value that no key of the split can have is refused") {
  const auto recipe = [](const std::string& held_out, const std::string& draws) {
    return "[dataset]\nsamples = 20\n[dataset.split]\nby = [\"seafloor\", \"draw.site\"]\n" +
           held_out + "\n[draw]\n" + draws;
  };
  const std::string sites = "site = { choice = [\"harbour\", \"bay\", \"fjord\"] }\n";
  const std::string table =
      "n = { int = [1, 2] }\nsite = { by = \"draw.n\", table = { 1 = \"bay\", default = "
      "{ choice = [\"fjord\", \"harbour\"] } } }\n";
  for (const std::string& draws : {sites, table}) {
    check_refused(recipe("held_out_test = [\"bay\", \"fiord\"]", draws),
                  "r.toml: 'dataset.split.held_out_test' names \"fiord\", which no value of "
                  "draw.site matches; expected some of bay, fjord, harbour");
    check_refused(recipe("held_out_val = [\"x*\"]", draws), "'dataset.split.held_out_val' names");
    CHECK(recipe_of(recipe("held_out_test = [\"har*\"]\nheld_out_val = [\"bay\"]", draws))
              .warnings()
              .empty());
  }
  check_refused(recipe("held_out_test = [\"fiord\"]", "site = \"fjord\""),
                "expected some of fjord");
  // A number may have any value.
  const auto warnings = [&](const std::string& held_out, const std::string& draws) {
    return recipe_of(recipe(held_out, draws)).warnings();
  };
  CHECK(warnings("held_out_test = [\"2\"]", "site = { int = [1, 3] }").empty());
  const auto of_number = warnings("held_out_test = [\"2\", \"5\"]", "site = { int = [1, 3] }");
  REQUIRE(of_number.size() == 1);
  CHECK(of_number[0].starts_with("dataset.split.held_out_test names \"5\", which no sample has"));
  // A value that could be drawn, but is not.
  const std::string rare = "site = { choice = [\"bay\", \"fjord\"], weights = [1, 0] }";
  CHECK(warnings("held_out_val = [\"fjord\"]", rare).size() == 1);
  CHECK(warnings("held_out_val = [\"bay\"]", rare).empty());
}

TEST_CASE("a dataset without labels is warned of, and refused if pieces are to be cut") {
  const std::string off = "[dataset]\nslant = false\n";
  CHECK(recipe_of("[dataset]\n").warnings().empty());
  CHECK(recipe_of(off + "ground_px_m = 0.1\n").warnings().empty());
  REQUIRE(recipe_of(off).warnings().size() == 1);
  CHECK(recipe_of(off).warnings()[0].ends_with("set dataset.ground_px_m, or leave slant out"));
  for (const std::string pieces :
       {"[dataset.tiles]\nwidth_px = 9\nheight_px = 9\n", "[dataset.chips]\nmargin = [0.5]\n"}) {
    check_refused(off + pieces, "r.toml: with 'dataset.slant' = false there are no images to cut");
    CHECK_NOTHROW(recipe_of(off + "ground_px_m = 0.1\n" + pieces));
  }
}

TEST_CASE("options of chips that do not fit each other are refused") {
  check_refused("[dataset.chips]\nsize_m = 3\nmargin = 0.2\n", "'dataset.chips.margin' is");
  check_refused("[dataset.chips]\nsize_m = 3\nmargin = [0.2]\n", "size_m or margin");
  check_refused("[dataset.chips]\nmargin = [0.5, 0.2]\n", "[least, most]");
  check_refused("[dataset.chips]\nhard_negatives = 2\n", "a size_px, size_m or margin");
  check_refused(
      "[dataset.chips]\nsize_px = 9\nclasses = [\"mine\"]\n[[objects]]\nshape = "
      "\"box\"\nclass = \"crate\"\n",
      "names \"mine\", which no target is; expected some of crate");
  check_refused(
      "[dataset]\nshadow_class = true\n[[objects]]\nshape = \"box\"\nclass = "
      "\"shadow\"\n",
      "the class shadow, which the recipe has already");
}

TEST_CASE("a * draws a file of the data folder, and its class is drawn with it") {
  const ensonify::tests::TemporaryFolder folder;
  const std::string mesh =
      "v 0 0 0\nv 4 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
  std::filesystem::create_directories(folder / "hulls/old");
  for (const char* name : {"hulls/barge.obj", "hulls/ship_a.obj", "hulls/ship_b.obj",
                           "hulls/old/ship_c.obj", "hulls/readme.txt"})
    ensonify::tests::write_text(folder / name, mesh);
  const auto text = [](const std::string& pattern) {
    return "version = 1\n[dataset]\nsamples = 60\n[[objects]]\nmesh = \"" + pattern +
           "\"\nlength_m = { uniform = [20, 60] }\nclass = { by = \"objects.0.mesh\", table = { "
           "\"data:hulls/ship_*\" = \"wreck\", default = \"barge\" } }\n";
  };
  const Recipe recipe(text("data:hulls/*.obj"), "r.toml", folder.path());
  std::map<std::string, std::string> classes;
  for (std::size_t i = 0; i < recipe.samples(); ++i) {
    const SampleScene sample = recipe.sample(i);
    const ObjectOptions& object = sample.scene.objects.front();
    classes[object.mesh.name] = object.class_name;
    CHECK(*object.size.length_m >= 20.0);
  }
  CHECK(classes == std::map<std::string, std::string>{{"data:hulls/barge.obj", "barge"},
                                                      {"data:hulls/ship_a.obj", "wreck"},
                                                      {"data:hulls/ship_b.obj", "wreck"}});
  CHECK(recipe.assets() == std::vector<std::string>{"data:hulls/barge.obj", "data:hulls/ship_a.obj",
                                                    "data:hulls/ship_b.obj"});
  CHECK(recipe.class_names() == std::vector<std::string>{"barge", "wreck", "seabed"});
  CHECK_THROWS_WITH(Recipe(text("data:hulls/*.stl"), "r.toml", folder.path()),
                    Catch::Contains("r.toml:5:8: \"data:hulls/*.stl\" matches no file in"));
  CHECK_THROWS_WITH(Recipe(text("data:hulls/*.obj"), "r.toml", {}),
                    Catch::Contains("give the data folder, with --data DIR"));
}

TEST_CASE("a table's entry is that of the value, then of a pattern, then the default") {
  Distribution d;
  for (const char* name : {"a", "a*", "*c", "default"}) d.table[name];
  CHECK(d.entry_for("a")->first == "a");
  CHECK(d.entry_for("ab")->first == "a*");
  CHECK(d.entry_for("bc")->first == "*c");
  CHECK(d.entry_for("b")->first == "default");
  for (const char* name : {"x*", "x/u_*", "x/*"}) d.table[name];
  CHECK(d.entry_for("x/u_1")->first == "x/u_*");  // the most characters, not the first
  CHECK(d.entry_for("x/v_1")->first == "x/*");
  d.table.erase("default");
  CHECK(d.entry_for("b") == nullptr);
  CHECK(matches("x/a.stl", "x/*.stl"));
  CHECK(matches("x/.stl", "x/*.stl"));
  CHECK(matches("x/ab/c.stl", "x/*/*.stl"));
  CHECK_FALSE(matches("x/y/a.stl", "x/*.stl"));
  CHECK_FALSE(matches("x/a.stl2", "x/*.stl"));
  CHECK(matches("abcbc", "a*bc"));
  CHECK(matches("a", "*a**"));
  CHECK_FALSE(matches("ab/c", "a*c"));
  CHECK_FALSE(matches("x/y", "*y"));
  // Many stars can match in many ways; the match takes neither stack nor time for each way.
  CHECK_FALSE(matches(std::string(1000, 'a'), std::string(1000000, '*') + "b"));
  std::string stars;
  for (int i = 0; i < 30; ++i) stars += "*a";
  CHECK_FALSE(matches(std::string(1000, 'a'), stars + "b"));
}

TEST_CASE(
    "a recipe's keys may be neither deep in each other nor depend on each other in long chains") {
  std::string key = "a";
  for (int i = 1; i < 31000; ++i) key += ".a";
  check_refused("[dataset]\nsamples = 2\n[draw]\n" + key + " = 1\n", "more than 64 deep");
  const auto chain = [](int keys) {
    std::string text = "[dataset]\nsamples = 2\n[draw]\nk0 = { uniform = [1, 2] }\n";
    for (int i = 1; i < keys; ++i)
      text += fmt::format("k{} = {{ times = \"draw.k{}\" }}\n", i, i - 1);
    return text + fmt::format("[track]\naltitude_m = {{ times = \"draw.k{}\" }}\n", keys - 1);
  };
  const double altitude_m = recipe_of(chain(63)).sample(0).scene.track.altitude_m;
  CHECK((altitude_m >= 1.0 && altitude_m <= 2.0));
  check_refused(chain(20000), "more than 64 keys depend on each other one after the other");
}

TEST_CASE("a whole number above 2^53 is the nearest double in a recipe, and none is drawn") {
  const auto drawn = [](const std::string& distribution) {
    return recipe_of("[dataset]\nsamples = 2\n[draw]\na = " + distribution + "\n")
        .sample(0)
        .drawn.at("draw.a");
  };
  CHECK(drawn("{ uniform = [9007199254740993, 9007199254740993] }") == "9007199254740992");
  CHECK(drawn("{ normal = [9007199254740993, 0], between = [1, 9223372036854775807] }") ==
        "9007199254740992");
  CHECK(drawn("{ choice = [1, 2], weights = [0, 9007199254740993] }") == "2");
  CHECK(drawn("{ choice = [9007199254740993] }") == "9007199254740993");  // perhaps a seed
  for (const char* ends : {"[1, 9007199254740993]", "[-9223372036854775807, 1]"}) {
    CAPTURE(ends);
    check_refused(fmt::format("[dataset]\nsamples = 2\n[draw]\na = {{ int = {} }}\n", ends),
                  "expected whole numbers from -9007199254740991 to 9007199254740991");
  }
  check_refused("[dataset]\nsamples = 2\n[track]\nheading_deg = { choice = [9007199254740993] }\n",
                "'track.heading_deg' is 9007199254740993, expected a number from -360 to 360");
}

TEST_CASE("overrides change values and distributions, also of keys that the recipe does not have") {
  const std::string text =
      "version = 1\nseed = 4\n[dataset]\nsamples = 8\n[track]\nspeed_mps = 2\naltitude_m = { "
      "uniform = [3, 12] }\n[[objects]]\npresent = { choice = [true, false] }\nshape = \"box\"\n"
      "[[objects]]\nshape = \"cone\"\nclass = \"mine\"\n";
  const auto with = [&](std::vector<std::string> overrides) {
    return Recipe(text, "r.toml", {}, std::move(overrides));
  };
  const Recipe plain = with({});
  const Recipe changed = with({"dataset.samples=3", "track.altitude_m=7",
                               "objects.1.heading_deg=90", "objects.1.class=old mine",
                               "track.climb_mps={uniform=[5, 6]}", "sonar.sidescan.range_m=20"});
  CHECK(changed.samples() == 3);
  CHECK(changed.class_names() == std::vector<std::string>{"object", "old mine", "seabed"});
  std::set<std::size_t> objects;
  for (std::size_t i = 0; i < 3; ++i) {
    const SampleScene sample = changed.sample(i);
    const Scene& scene = sample.scene;
    CHECK(scene.track.altitude_m == 7.0);
    CHECK(scene.track.speed_mps == 2.0);
    CHECK(scene.objects.back().heading_rad == Approx(1.5707963));
    CHECK(scene.objects.back().class_name == "old mine");
    CHECK((scene.track.climb_mps > 5.0 && scene.track.climb_mps <= 6.0));
    CHECK(scene.sonars.front().range_m == 20.0);
    CHECK(scene.seed == plain.sample(i).scene.seed);
    objects.insert(scene.objects.size());
  }
  CHECK(with({"seed=5"}).sample(0).scene.seed != plain.sample(0).scene.seed);
  for (std::size_t i = 0; i < 8; ++i)
    CHECK(with({"objects.0.present=true"}).sample(i).scene.objects.size() == 2);
  // An override of the list has fewer tables than the text: the others stay, also absent ones.
  const Recipe absent(
      "version = 1\n[dataset]\n[[objects]]\nshape = \"sphere\"\n[[objects]]\nshape = "
      "\"box\"\npresent = false\n",
      "r.toml", {}, {"objects=[{diameter_m=2}]"});
  CHECK(absent.sample(0).scene.objects.size() == 1);
  const auto check_message = [&](const std::string& override_text, const std::string& message) {
    CHECK_THROWS_WITH(with({override_text}), Catch::Contains(message));
  };
  check_message("track.altitude_m", "-D track.altitude_m: expected key=value");
  check_message("track.altitude_m=-7", "-D track.altitude_m=-7: 'track.altitude_m' is -7");
  check_message("track.altitude_m=x",
                "-D track.altitude_m=\"x\": 'track.altitude_m' is the string");
  check_message("track.altitude_m={uniform=[-8, -7]}", "-D track.altitude_m=-7");
  CHECK_THROWS_WITH(
      Recipe("version = 1\n[dataset]\n[track]\naltitude_m = { times = \"track.speed_mps\" }\n",
             "r.toml", {}, {"track.speed_mps=x"}),
      Catch::Contains("-D track.speed_mps=x: 'track.speed_mps' is \"x\", expected a number"));
  check_message("dataset.seafloors=9", "expected at most that number; with -D dataset.seafloors=9");
  check_message("track.altitudem=7", "did you mean 'altitude_m'?");
  check_message("dataset.tiles.size_px=7",
                "unknown key \"size_px\" in [dataset.tiles]; expected one of width_px, height_px, "
                "width_m, height_m, stride, least_bed");
  check_message("dataset.sample=7", "-D dataset.sample=7: unknown key \"sample\"");
  check_message("sea.temperature_c={uniform=[6, 5]}", "-D sea.temperature_c={uniform=[6, 5]}: ");
}

TEST_CASE("renders draw the display again and nothing else") {
  const std::string stratified = GENERATE("", ", stratified = true");
  const Recipe recipe =
      recipe_of("[dataset]\nsamples = 2\nrenders = 3\n[display]\ngain_db = { uniform = [-6, 6]" +
                stratified + " }\n");
  const SampleScene sample = recipe.sample(1);
  REQUIRE(sample.renders.size() == 3);
  CHECK(sample.renders[0].gain_db == sample.scene.display.gain_db);
  CHECK(sample.renders[1].gain_db != sample.renders[0].gain_db);
  CHECK(sample.renders[2].gain_db != sample.renders[1].gain_db);
}

TEST_CASE("an error in a recipe names its place") {
  check_refused("[track]\n", "no [dataset]");
  check_refused("[dataset]\nsample = 3\n", "did you mean 'samples'?");
  check_refused("[dataset]\nsamples = 0\n", "r.toml:3:11: 'dataset.samples' is 0");
  check_refused("[dataset]\n[track]\naltitude_m = { unifrom = [3, 12] }\n",
                "r.toml:4:14: 'track.altitude_m': unknown distribution \"unifrom\"; did you mean "
                "'uniform'?");
  check_refused("[dataset]\n[track]\naltitude_m = { about = 3 }\n", "or a distribution of it");
  check_refused("[dataset]\n[track]\naltitude_m = { uniform = [3, 12], wieghts = [1] }\n",
                "unknown word \"wieghts\" in the distribution of 'track.altitude_m'; did you mean "
                "'weights'?");
  check_refused("[dataset]\n[track]\naltitude_m = { uniform = [3, 12], uniform = [3, 4] }\n",
                "r.toml:4:");
  check_refused("[dataset]\n[track]\naltitude_m = { uniform = [3, 12], normal = [3, 4] }\n",
                "more than one distribution");
  check_refused("[dataset]\n[track]\naltitude_m = { uniform = [12, 3] }\n",
                "uniform begins at 12, above its end at 3");
  check_refused("[dataset]\n[track]\naltitude_m = { uniform = [3] }\n",
                "expected uniform = [least, most]");
  check_refused("[dataset]\n[track]\naltitude_m = { log_uniform = [0, 3] }\n",
                "expected more than 0");
  check_refused(
      "[dataset]\n[track]\naltitude_m = { times = \"sonar.x.range_m\", uniform = [0, 3] }\n",
      "gives no value to 'sonar.x.range_m'");
  check_refused(
      "[dataset]\n[track]\naltitude_m = { times = \"track.speed_mps\" }\nspeed_mps = { times = "
      "\"track.altitude_m\" }\n",
      "depends on itself");
  check_refused("[dataset]\n[track]\naltitudem = { uniform = [3, 12] }\n",
                "did you mean 'altitude_m'?");
  check_refused(
      "[dataset]\n[seafloor]\nmaterial = { choice = [\"sand\", \"mud\"], weights = [1] }\n",
      "as many weights");
  check_refused(
      "[dataset]\n[draw]\na = { by = \"draw.b\", table = { x = 1 } }\nb = { choice = [\"y\"] }\n",
      "no entry for draw.b = y");
  check_refused("[dataset]\nsamples = 2\nseafloors = 3\n", "'dataset.seafloors' is more");
  check_refused("[dataset.tiles]\nwidth_px = 3\n", "width_px and height_px");
  check_refused("seed = { uniform = [1, 2] }\n[dataset]\n", "'seed' is that of all draws");
  const Recipe deep =
      recipe_of("[dataset]\nsamples = 64\n[track]\naltitude_m = { uniform = [0, 0.02] }\n");
  CHECK_THROWS_WITH(
      [&] {
        for (std::size_t i = 0; i < 64; ++i) deep.sample(i);
      }(),
      Catch::Contains("r.toml:5:14: 'track.altitude_m' is 0.00"));
  check_refused("[dataset]\n[track]\naltitude_m = { uniform = [-2, 0] }\n",
                "r.toml:4:14: 'track.altitude_m' is -");
}

TEST_CASE("a layer that no sample has need not fit the seabed") {
  const auto with = [](const std::string& present, int samples) {
    return "[dataset]\nsamples = " + std::to_string(samples) +
           "\n[seafloor]\ncell_m = 0.2\n[[seafloor.crests]]\nclass = \"ripples\"\npresent = " +
           present + "\nwavelength_m = { uniform = [0.3, 0.4] }\nheight_m = 0.02\n";
  };
  for (const char* never : {"false", "{ choice = [true, false], weights = [0, 1] }"})
    for (const int samples : {1, 2}) {
      CAPTURE(never, samples);
      const Recipe recipe = recipe_of(with(never, samples));
      CHECK(recipe.sample(0).scene.seafloor.seabed.bedforms.empty());
      CHECK(recipe.class_names() == std::vector<std::string>{"ripples", "seabed"});
    }
  check_refused(with("true", 1), "need cells of");
}

TEST_CASE("classes of layers whose features have instances are targets, others are ground") {
  const SeabedOptions none;
  for_each_relief_list(none, [&]<class Relief>(const std::vector<ReliefLayer<Relief>>&) {
    const ReliefKind<Relief>& kind = kind_of(Relief{});
    CAPTURE(kind.list);
    const Recipe recipe =
        recipe_of("[dataset]\nsamples = 2\n[seafloor]\ncell_m = 0.2\n[[seafloor." +
                  std::string(kind.list) + "]]\nclass = { choice = [\"a\", \"b\"] }\n");
    CHECK(recipe.target_classes() == (kind.has_instances() ? 2 : 0));
    CHECK(recipe.class_names() == std::vector<std::string>{"a", "b", "seabed"});
  });
}

TEST_CASE("a recipe over beds that were analysed has the names of the recipes of these beds") {
  const ensonify::tests::TemporaryFolder folder;
  const std::string bed = R"(version = 1
[dataset]
samples = 2
[seafloor]
extent_east_m = 40
extent_north_m = 40
cell_m = 0.4
[[seafloor.patches]]
share = 0.4
patch_m = 10
class = "rough"
material = "gravel"
)";
  const std::vector<std::string> beds{bed + R"(
[[objects]]
shape = "ladder"
class = "ladder"
part_classes = true
)",
                                      bed + R"(
[[seafloor.boulders]]
per_hectare = 200
diameter_m = 2
class = "stone"
[[objects]]
shape = "box"
class = "crate"
material = "wood"
)"};
  const auto analysed = [&](const Scene& scene, const std::string& name) {
    Seafloor seafloor = seafloor_of(scene);
    analyse(seafloor, 1);
    save_analysed(seafloor, "", folder / name);
  };
  const auto recipe_over = [&](const std::string& files) {
    return Recipe(
        "version = 1\n[dataset]\nsamples = 2\n[seafloor]\nkind = \"progressive\"\n"
        "progressive = " +
            files + "\n",
        (folder / "r.toml").string(), {});
  };
  std::set<std::string> targets, classes, materials;
  const auto targets_of = [](const Recipe& recipe) {
    const std::vector<std::string> names = recipe.class_names();
    return std::set(names.begin(),
                    names.begin() + static_cast<std::ptrdiff_t>(recipe.target_classes()));
  };
  for (std::size_t i = 0; i < 2; ++i) {
    const Recipe expected(beds[i], "r.toml", {});
    analysed(expected.sample(0).scene, fmt::format("{}.pm", i));
    const Recipe over = recipe_over(fmt::format("\"{}.pm\"", i));
    CHECK(over.class_names() == expected.class_names());
    CHECK(over.target_classes() == expected.target_classes());
    CHECK(over.material_names() == expected.material_names());
    targets.merge(targets_of(expected));
    for (const std::string& name : expected.class_names()) classes.insert(name);
    for (const std::string& name : expected.material_names()) materials.insert(name);
  }
  CHECK(targets == std::set<std::string>{"crate", "ladder", "stone"});
  const Recipe both = recipe_over("{ choice = [\"0.pm\", \"1.pm\"] }");
  CHECK(targets_of(both) == targets);
  const auto as_set = [](const auto& names) { return std::set(names.begin(), names.end()); };
  CHECK(as_set(both.class_names()) == classes);
  CHECK(as_set(both.material_names()) == materials);
  CHECK_THROWS_WITH(recipe_over("\"none.pm\""), Catch::Contains("No such file"));
  ensonify::tests::write_text(folder / "text.pm", bed);
  CHECK_THROWS_WITH(recipe_over("\"text.pm\""), Catch::Contains("not a progressive mesh"));
}

TEST_CASE("what a dataset's labels cannot follow is refused with what to do instead") {
  for (const char* correction : {"true", "{ choice = [false, true] }"})
    check_refused(
        "[dataset]\n[display]\nslant_range_correction = " + std::string(correction),
        "r.toml:4:26: 'display.slant_range_correction' is true, but a dataset's labels are "
        "made in slant range: leave it out; 'dataset.ground_px_m' makes");
  CHECK_NOTHROW(recipe_of("[dataset]\n[display]\nslant_range_correction = false\n"));
  check_refused("[dataset]\n[output]\npng_bits = 16\n",
                "r.toml:4:12: 'output.png_bits' is 16, but a dataset's pictures have 8 bits");
  check_refused(
      "[dataset]\n[output]\npings_per_file = { choice = [0, 50] }\n",
      "r.toml:4:18: 'output.pings_per_file' is 50, but a sample has one part: leave it out");
  check_refused("[dataset]\n[output]\nfile_per_leg = true\n[track]\nkind = \"lawn-mower\"\n",
                "'output.file_per_leg' is true, but a sample has one part");
  check_refused("[dataset]\n[output]\nclass_names = [\"mine\"]\n", "leave them out");
  check_refused(
      "[dataset]\n[[objects]]\nshape = \"box\"\nclass = { choice = [\"mine\", \"none\"] }\n",
      "a class can be \"none\", which is the name of number 0");
}

TEST_CASE("an assembly's next object may become its base, and its class is then a target's") {
  const Recipe recipe = recipe_of(R"(
[dataset]
samples = 8
[[objects]]
present = { choice = [true, false] }
shape = "sphere"
class = "mine"
assembly = "mooring"
[[objects]]
shape = "box"
class = "anchor"
assembly = "mooring"
[[objects]]
shape = "box"
class = "shackle"
assembly = "mooring"
)");
  std::set<std::string> bases;
  for (std::size_t i = 0; i < recipe.samples(); ++i)
    bases.insert(recipe.sample(i).scene.objects.front().class_name);
  CHECK(bases == std::set<std::string>{"anchor", "mine"});
  CHECK(recipe.target_classes() == 2);  // the shackle is never the base
  CHECK(recipe.class_names() == std::vector<std::string>{"anchor", "mine", "seabed"});
}

TEST_CASE("a drawn count of 0 leaves the object out, and with a base its assembly") {
  const Recipe recipe = recipe_of(R"(
[dataset]
samples = 12
[[objects]]
shape = "tyre"
class = "tyre"
count = { int = [0, 2], stratified = true }
[[objects]]
shape = "sphere"
class = "mine"
assembly = "mooring"
count = { choice = [0, 3], stratified = true }
[[objects]]
shape = "box"
class = "anchor"
assembly = "mooring"
[[objects]]
shape = "box"
class = "crate"
count = 0
)");
  CHECK(recipe.class_names() == std::vector<std::string>{"crate", "mine", "tyre", "seabed"});
  std::set<std::string> tyres, mines;
  for (std::size_t i = 0; i < recipe.samples(); ++i) {
    const SampleScene sample = recipe.sample(i);
    std::map<std::string, int> count;  // of what the scene has
    for (const ObjectOptions& object : sample.scene.objects)
      count[object.class_name] = object.count;
    std::map<std::string, int> drawn{{"crate", 0}};  // one, at its place
    if (const int tyre = std::stoi(sample.drawn.at("objects.0.count")); tyre > 0)
      drawn["tyre"] = tyre;
    if (const int mine = std::stoi(sample.drawn.at("objects.1.count")); mine > 0)
      drawn.insert({{"mine", mine}, {"anchor", 0}});
    CHECK(count == drawn);
    tyres.insert(sample.drawn.at("objects.0.count"));
    mines.insert(sample.drawn.at("objects.1.count"));
  }
  CHECK(tyres == std::set<std::string>{"0", "1", "2"});
  CHECK(mines == std::set<std::string>{"0", "3"});
}

TEST_CASE("every sample's scene numbers its labels as the dataset does") {
  const Recipe recipe = recipe_of(
      "[dataset]\nsamples = 4\n[[objects]]\nshape = \"box\"\nclass = { choice = [\"b\", \"a\"] "
      "}\n");
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(recipe.sample(i).scene.output.class_names == recipe.class_names());
    CHECK(recipe.sample(i).scene.output.sediment_names == recipe.material_names());
  }
}

TEST_CASE("names with quotes, backslashes and tabs are the names of the samples") {
  const Recipe recipe = recipe_of(R"(
[dataset]
samples = 4
[dataset.split]
by = ["draw.kind"]
held_out_test = ["a \"b\""]
[draw]
kind = { choice = ["a \"b\"", "c"], stratified = true }
[[objects]]
shape = "box"
class = { by = "draw.kind", table = { "a \"b\"" = "A\\B", c = "C\t1" } }
tall_m = { by = "objects.0.class", table = { "A\\B" = 1.0, "C\t1" = 2.0 } }
)");
  CHECK(recipe.class_names() == std::vector<std::string>{"A\\B", "C\t1", "seabed"});
  std::set<std::string> classes;
  for (std::size_t i = 0; i < 4; ++i) {
    const SampleScene sample = recipe.sample(i);
    const ObjectOptions& object = sample.scene.objects.at(0);
    classes.insert(object.class_name);
    CHECK(object.size.shape_height_m == (object.class_name == "A\\B" ? 1.0 : 2.0));
    CHECK((sample.split == "test") == (object.class_name == "A\\B"));
  }
  CHECK(classes == std::set<std::string>{"A\\B", "C\t1"});
}

TEST_CASE("each split of the recipe for target recognition shows each class, on separate seabeds") {
  const Recipe recipe(ensonify::tests::source_folder() / "scenes/target_recognition.toml", {});
  std::map<std::string, std::set<std::string>> classes;
  std::map<std::size_t, std::set<std::string>> splits;
  for (std::size_t i = 0; i < recipe.samples(); ++i) {
    const SampleScene sample = recipe.sample(i);
    for (const ObjectOptions& object : sample.scene.objects)
      classes[sample.split].insert(object.class_name);
    splits[sample.seafloor].insert(sample.split);
  }
  REQUIRE(classes.size() == 3);
  for (const auto& [split, names] : classes) {
    CAPTURE(split);
    CHECK(names == std::set<std::string>{"boulder", "drum", "mine", "tyre"});
  }
  CHECK(splits.size() == recipe.seafloors());
  for (const auto& [seafloor, names] : splits) CHECK(names.size() == 1);
}
