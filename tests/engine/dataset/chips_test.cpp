#include <set>

#include "support/catch.h"

#include <ensonify/engine/dataset/chips.h>

using namespace ensonify::engine;

namespace {

/// A line of 60 pings and 2 x 100 bins: pixels of 0.1 m across and 0.2 m along the track.
LabelledImage sample_line() {
  Sonar sonar;
  sonar.bins = 100;
  sonar.range_m = 10.0;
  Waterfall line(sonar, 60);
  for (std::size_t i = 0; i < line.rows(); ++i) {
    line.pings[i].pose.position = {0.0, 0.2 * double(i), -5.0};
    line.pings[i].altitude_m = 3.0;
  }
  std::ranges::fill(line.pixels.region, std::uint32_t(Region::seabed));
  std::ranges::fill(line.pixels.class_id, 3u);
  return slant_view(line, {});
}

/// The names of the numbers 1, 2, 3, 4.
const std::vector<std::string> classes{"mine", "stone", "seabed", "outcrop"};

void paint(LabelledImage& line, const Rectangle& part, Region region, std::uint32_t class_id,
           std::uint32_t instance = 0, std::uint32_t shadow_of = 0) {
  for (std::size_t row = part.row; row < part.row + part.rows; ++row)
    for (std::size_t column = part.column; column < part.column + part.columns; ++column) {
      const std::size_t i = (line.labels.rows() - 1 - row) * line.labels.columns() + column;
      line.labels.pixels.region[i] = std::uint32_t(region);
      line.labels.pixels.class_id[i] = class_id;
      line.labels.pixels.instance[i] = instance;
      line.labels.pixels.shadow_instance[i] = shadow_of;
    }
}

std::map<std::uint32_t, TargetRecord> records_of(const LabelledImage& line) {
  std::map<std::uint32_t, TargetRecord> records;
  for (Target& target : find_targets(line.labels)) {
    TargetRecord record;
    record.class_name = target.instance == 1 ? "mine" : "stone";
    record.object = TargetRecord::Object{};
    const std::uint32_t instance = target.instance;
    record.target = std::move(target);
    records.emplace(instance, std::move(record));
  }
  return records;
}

std::vector<Chip> chips_of(const LabelledImage& line, const ChipOptions& options,
                           std::uint64_t seed = 1) {
  return choose_chips(line, records_of(line), classes, {.chips = options}, {seed, 0, 0});
}

std::array<std::size_t, 4> corners(const Rectangle& part) {
  return {part.column, part.row, part.columns, part.rows};
}

/// A mine of 8 x 4 pixels with a shadow beyond it, and a stone of 3 x 3 pixels.
LabelledImage line_with_targets() {
  LabelledImage line = sample_line();
  paint(line, {120, 20, 8, 4}, Region::object, 1, 1);
  paint(line, {128, 20, 12, 4}, Region::shadow, 3, 0, 1);
  paint(line, {40, 40, 3, 3}, Region::object, 2, 2);
  return line;
}

}  // namespace

TEST_CASE("chips of a relative size are square on the ground, about the body or with its shadow") {
  const LabelledImage line = line_with_targets();
  // Body and shadow are 20 x 4 pixels, 2 m x 0.8 m: with half of the longer side around, 4 m.
  std::vector<Chip> chips = chips_of(line, {.margin = {0.5}, .classes = {"mine"}});
  REQUIRE(chips.size() == 1);
  CHECK(chips[0].kind == "chip");
  CHECK(chips[0].of == "mine");
  CHECK(corners(chips[0].part) == std::array<std::size_t, 4>{110, 12, 40, 20});
  // The body alone is 0.8 m x 0.8 m.
  chips = chips_of(line, {.margin = {0.5}, .with_shadow = false, .classes = {"mine"}});
  REQUIRE(chips.size() == 1);
  CHECK(corners(chips[0].part) == std::array<std::size_t, 4>{116, 18, 16, 8});
  // Margins are drawn between two numbers.
  std::set<std::size_t> columns;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Chip chip = chips_of(line, {.margin = {0.25, 1.0}, .classes = {"mine"}}, seed).front();
    CHECK(chip.part.columns >= 30);
    CHECK(chip.part.columns <= 60);
    CHECK(std::abs(double(chip.part.columns) - 2.0 * double(chip.part.rows)) <= 1.0);
    columns.insert(chip.part.columns);
  }
  CHECK(*columns.begin() < 36);
  CHECK(*columns.rbegin() > 54);
  // Never larger than the line, which is 12 m long.
  chips = chips_of(line, {.margin = {50.0}});
  REQUIRE(chips.size() == 2);
  for (const Chip& chip : chips) CHECK(corners(chip.part)[3] == 60);
}

TEST_CASE("a chip shows the whole body first, then as much of the shadow as there is room for") {
  // The shadow is longer than the chip, and lies beyond the body on either side.
  for (const bool to_port : {false, true}) {
    CAPTURE(to_port);
    LabelledImage line = sample_line();
    paint(line, {to_port ? 72u : 120u, 20, 8, 4}, Region::object, 1, 1);
    paint(line, {to_port ? 32u : 128u, 20, 40, 4}, Region::shadow, 3, 0, 1);
    const auto part = [&](const ChipOptions& options, bool object = true) {
      std::map<std::uint32_t, TargetRecord> records = records_of(line);
      if (!object) records.at(1).object.reset();
      const std::vector<Chip> chips =
          choose_chips(line, records, classes, {.chips = options}, {1, 0, 0});
      REQUIRE(chips.size() == 1);
      CHECK(chips[0].instance == 1);
      return corners(chips[0].part);
    };
    using Part = std::array<std::size_t, 4>;
    const Part beside = to_port ? Part{64, 14, 16, 16} : Part{120, 14, 16, 16};
    CHECK(part({.size_px = 16}) == beside);
    CHECK(part({.size_px = 16}, false) == beside);  // a feature of the bed
    CHECK(part({.size_px = 50})[0] == (to_port ? 31u : 119u));
    CHECK(part({.size_px = 16, .with_shadow = false})[0] == (to_port ? 68u : 116u));
    // The target is a hard negative if `classes` does not have its class.
    const std::vector<Chip> negatives =
        chips_of(line, {.size_px = 16, .classes = {"stone"}, .hard_negatives = 1});
    REQUIRE(negatives.size() == 1);
    CHECK(negatives[0].instance == 1);
    CHECK(corners(negatives[0].part) == beside);
  }
}

TEST_CASE("a chip of an object that is larger than the chip shows some of it, also of a bent one") {
  LabelledImage line = sample_line();
  paint(line, {110, 10, 40, 2}, Region::object, 1, 1);
  paint(line, {110, 12, 2, 38}, Region::object, 1, 1);
  const std::vector<Chip> chips = chips_of(line, {.size_px = 10});
  REQUIRE(chips.size() == 1);
  std::size_t shown = 0;
  const Rectangle& part = chips[0].part;
  for (std::size_t row = part.row; row < part.row + part.rows; ++row)
    for (std::size_t column = part.column; column < part.column + part.columns; ++column)
      shown += line.labels.pixels.instance[line.flipped(row, column)] == 1;
  CHECK(shown >= 20);
}

TEST_CASE("of a line that does not move only chips in pixels can be cut") {
  LabelledImage line = line_with_targets();
  for (PingRow& ping : line.labels.pings) ping.pose.position.y() = 0.0;
  line = slant_view(line.labels, {});
  CHECK_THROWS_WITH(chips_of(line, {.size_m = 2.0}),
                    Catch::StartsWith("the line does not move, so that no number of its pings"));
  CHECK(chips_of(line, {.size_px = 16}).size() == 2);
}

TEST_CASE("chips are of the chosen classes and of bodies with enough pixels") {
  const LabelledImage line = line_with_targets();
  const auto number = [&](const ChipOptions& options) { return chips_of(line, options).size(); };
  CHECK(number({.size_px = 10}) == 2);
  CHECK(number({.size_px = 10, .classes = {"stone"}}) == 1);
  CHECK(number({.size_px = 10, .least_px = 9}) == 2);
  CHECK(number({.size_px = 10, .least_px = 10}) == 1);
  CHECK(number({.size_px = 10, .least_px = 33}) == 0);
  CHECK_THROWS_WITH(chips_of(line, {.size_px = 61}), Catch::Contains("'dataset.chips' needs"));
}

TEST_CASE("objects that are ignored for their size have no chips, and are in no background") {
  LabelledImage line = line_with_targets();
  paint(line, {20, 20, 8, 1}, Region::seabed, 4, 3);  // a pit
  std::map<std::uint32_t, TargetRecord> records = records_of(line);
  records.at(3).object.reset();
  records.at(3).class_name = "pit";
  // By class, how many chips of a kind there are. The mine has 32 pixels, the stone 9, the pit 8.
  const auto found = [&](const DatasetOptions& options, const std::string& kind) {
    std::map<std::string, int> all;
    for (const Chip& chip : choose_chips(line, records, classes, options, {1, 0, 0}))
      if (chip.kind == kind) ++all[chip.of];
    return all;
  };
  using Found = std::map<std::string, int>;
  const ChipOptions chips{.size_px = 10};
  CHECK(found({.least_px = 9, .chips = chips}, "chip") ==
        Found{{"mine", 1}, {"pit", 1}, {"stone", 1}});
  CHECK(found({.least_px = 10, .chips = chips}, "chip") == Found{{"mine", 1}, {"pit", 1}});
  CHECK(found({.least_px = 33, .chips = chips}, "chip") == Found{{"pit", 1}});
  const ChipOptions negatives{.size_px = 10, .classes = {"mine"}, .hard_negatives = 9};
  CHECK(found({.least_px = 9, .chips = negatives}, "hard_negative") ==
        Found{{"pit", 1}, {"stone", 1}});
  CHECK(found({.least_px = 10, .chips = negatives}, "hard_negative") == Found{{"pit", 1}});
  const DatasetOptions backgrounds{.least_px = 33, .chips = {.size_px = 12, .backgrounds = 40}};
  for (const Chip& chip : choose_chips(line, records, classes, backgrounds, {1, 0, 0}))
    if (chip.kind == "background")
      for (const auto& [instance, record] : records) {
        const Outline& body = record.target.body;
        const Rectangle& part = chip.part;
        CHECK((int(part.column + part.columns) <= body.low[0] || int(part.column) >= body.high[0] ||
               int(part.row + part.rows) <= body.low[1] || int(part.row) >= body.high[1]));
      }
}

TEST_CASE("backgrounds show no target, also not of a class without chips or of the bed") {
  LabelledImage line = line_with_targets();
  paint(line, {0, 30, 200, 2}, Region::seabed, 4, 3);  // a trawl mark across the line
  std::map<std::uint32_t, TargetRecord> records = records_of(line);
  records.at(3).object.reset();
  std::size_t found = 0;
  for (const ChipOptions& options : {ChipOptions{.size_px = 12, .backgrounds = 6},
                                     {.size_px = 12, .classes = {"mine"}, .backgrounds = 6}})
    for (const Chip& chip : choose_chips(line, records, classes, {.chips = options}, {1, 0, 0})) {
      if (chip.kind != "background") continue;
      ++found;
      const Rectangle& part = chip.part;
      for (std::size_t row = part.row; row < part.row + part.rows; ++row)
        for (std::size_t column = part.column; column < part.column + part.columns; ++column) {
          const std::size_t i = (line.labels.rows() - 1 - row) * line.labels.columns() + column;
          REQUIRE(line.labels.pixels.instance[i] == 0);
          REQUIRE(line.labels.pixels.shadow_instance[i] == 0);
        }
    }
  CHECK(found == 12);
}

TEST_CASE("at least half of a background is bed") {
  LabelledImage line = line_with_targets();
  paint(line, {60, 0, 80, 60}, Region::water_column, 0);
  CHECK(bed_share(line, {50, 10, 20, 10}) == 0.5);
  std::size_t found = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed)
    for (const Chip& chip : chips_of(line, {.size_px = 12, .backgrounds = 6}, seed))
      if (chip.kind == "background") {
        ++found;
        CHECK(bed_share(line, chip.part) >= 0.5);
      }
  CHECK(found == 30);
  paint(line, {0, 0, 200, 60}, Region::water_column, 0);
  CHECK(chips_of(line, {.size_px = 12, .backgrounds = 6}).empty());
}

TEST_CASE("hard negatives show other targets, relief shadows and outcrops, never a chosen target") {
  LabelledImage line = line_with_targets();
  paint(line, {160, 45, 6, 5}, Region::shadow, 3);
  paint(line, {10, 5, 20, 10}, Region::seabed, 4);
  paint(line, {133, 26, 4, 4}, Region::shadow, 3);  // too near the mine
  std::set<std::string> of;
  for (std::uint64_t seed = 1; seed <= 20; ++seed)
    for (const Chip& chip :
         chips_of(line, {.size_px = 12, .classes = {"mine"}, .backgrounds = 2, .hard_negatives = 2},
                  seed)) {
      if (chip.kind == "chip") continue;
      const Rectangle& part = chip.part;
      const bool apart = part.column >= 140 || part.column + part.columns <= 120 ||
                         part.row >= 24 || part.row + part.rows <= 20;
      CHECK(apart);
      if (chip.kind != "hard_negative") continue;
      of.insert(chip.of);
      // The middle of a chip is on the chip's target, or on the pixel before.
      const std::size_t column = part.column + 5, row = part.row + 5;
      if (chip.of == "shadow") CHECK((column >= 159 && column < 166 && row >= 44 && row < 50));
      if (chip.of == "stone") CHECK((column >= 39 && column < 43 && row >= 39 && row < 43));
    }
  CHECK(of == std::set<std::string>{"outcrop", "shadow", "stone"});
  // There are three of them.
  CHECK(chips_of(line, {.size_px = 12, .classes = {"mine"}, .hard_negatives = 9}).size() == 4);
}
