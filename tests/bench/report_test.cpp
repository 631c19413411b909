// The benchmark's reports of any measurements.

#include "report.h"

#include <algorithm>
#include <fstream>
#include <sstream>

#include <nlohmann/json.hpp>

#include "compare.h"
#include "harness.h"
#include "html.h"
#include "scenes.h"
#include "support/catch.h"
#include "support/paths.h"

#include <ensonify/engine/base/clock.h>

using namespace ensonify;
using namespace ensonify::bench;

namespace {

Results some_results() {
  Results results;
  Cell& cell = results.cells.emplace_back();
  cell.name = "ping/smooth/2M/footprint/fan_scan";
  cell.bed = "smooth";
  cell.size = "2M";
  cell.surface = "footprint";
  cell.intersector = "fan_scan";
  cell.ping_ms = {0.5, 0.4, 0.6};
  cell.speedup = {3.0, 2.9, 3.1};
  cell.stages_over_ping = 0.99;
  cell.checked_rays = 69120;
  cell.mesh_mb = 24.5;
  results.runs.push_back({.name = "run/smooth/2M/2",
                          .threads = 2,
                          .pings = 960,
                          .prepare_s = 1.0,
                          .pings_s = 2.0,
                          .files_s = 3.0,
                          .wall_s = 6.0,
                          .pings_per_s = 480.0,
                          .speedup = {1.8, 1.7, 1.9}});
  results.runs.push_back({.name = "dataset/targets/2",
                          .threads = 2,
                          .samples = 16,
                          .pings = 6400,
                          .wall_s = 10.0,
                          .pings_per_s = 640.0,
                          .samples_per_s = 1.6,
                          .speedup = {1.9, 1.85, 1.95}});
  results.costs.push_back({.name = "refraction/ripples/2M/refined/full", .ratio = 2.0});
  results.harness = measure_harness(results.cells);
  return results;
}

std::size_t count(std::string_view text, std::string_view what) {
  std::size_t found = 0;
  for (std::size_t at = 0; (at = text.find(what, at)) != text.npos; at += what.size()) ++found;
  return found;
}

}  // namespace

TEST_CASE(
    "Every line of the CSV has the header's columns, and a run's values are in the right ones") {
  std::istringstream lines(csv(some_results()));
  std::vector<std::vector<std::string>> rows;
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string>& row = rows.emplace_back();
    std::istringstream fields(line + ",");
    for (std::string field; std::getline(fields, field, ',');) row.push_back(field);
  }
  REQUIRE(rows.size() == 4);
  const auto value = [&](std::size_t row, const char* column) {
    const auto at = std::ranges::find(rows[0], column) - rows[0].begin();
    return rows[row].at(static_cast<std::size_t>(at));
  };
  for (const auto& row : rows) CHECK(row.size() == rows[0].size());
  CHECK(value(1, "ping_ms") == "0.5000");
  CHECK(value(2, "pings_per_s") == "480.0");
  CHECK(value(2, "prepare_s") == "1.00");
  CHECK(value(2, "speedup") == "1.800");
  CHECK(value(2, "samples_per_s") == "");
  CHECK(value(3, "threads") == "2");
  CHECK(value(3, "samples_per_s") == "1.600");
  CHECK(value(3, "wall_s") == "10.00");
}

TEST_CASE(
    "The table and the page show everything that was measured, and the page closes its elements") {
  const Results results = some_results();
  const std::string page = html(to_json(results)), text = table(results);
  for (const char* name :
       {"run/smooth/2M/2", "dataset/targets/2", "refraction/ripples/2M/refined/full"}) {
    CHECK(count(page, name) == 1);
    CHECK(count(text, name) == 1);
  }
  CHECK(count(page, words(*results.harness)) == 1);
  CHECK(count(page, "<td>smooth</td><td>2M</td><td class=\"n\"></td><td class=\"n\">24.5</td>") ==
        1);
  for (const std::string element : {"table", "tr", "td", "figure", "p", "svg", "ul"})
    CHECK(count(page, "<" + element + ">") + count(page, "<" + element + " ") ==
          count(page, "</" + element + ">"));
}

TEST_CASE("A speedup that fell by more than the noise is reported for cells, runs and datasets") {
  const nlohmann::ordered_json before = to_json(some_results());
  Results slower = some_results();
  slower.cells[0].speedup = {2.9, 2.8, 3.0};
  slower.runs[0].speedup = {1.78, 1.7, 1.85};
  slower.runs[1].speedup = {1.5, 1.45, 1.55};
  const Comparison comparison = compare(before, to_json(slower));
  const std::vector<Change>& changes = comparison.changes;
  REQUIRE(changes.size() == 3);
  CHECK(comparison.only_before.empty());
  CHECK(comparison.only_now.empty());
  for (const Change& change : changes) {
    CAPTURE(change.name);
    CHECK(change.fell() == (change.name == "dataset/targets/2"));
  }
  const Comparison same = compare(before, before);
  for (const Change& change : same.changes) CHECK_FALSE(change.fell());
  // What the others are compared with cannot fall.
  Results with_reference = some_results();
  with_reference.runs.push_back(
      {.name = "run/smooth/2M/1", .threads = 1, .speedup = {1.0, 1.0, 1.0}});
  const nlohmann::ordered_json reference = to_json(with_reference);
  CHECK(compare(reference, reference).changes.size() == 3);
  // A report from before these rows existed.
  nlohmann::ordered_json old = before;
  old.erase("runs");
  CHECK(compare(old, before).changes.size() == 1);
  CHECK(compare(old, before).only_now.size() == 2);
  // A case that disagrees now has no valid speedup.
  nlohmann::ordered_json wrong = before;
  wrong["cells"][0]["agrees"] = false;
  const Comparison less = compare(before, wrong);
  CHECK(less.changes.size() == 2);
  CHECK(less.only_before == std::vector<std::string>{"ping/smooth/2M/footprint/fan_scan"});
  CHECK(table(less).find("1 in the older report only: ping/smooth/2M/footprint/fan_scan\n") !=
        std::string::npos);
}

TEST_CASE("An empty turn takes time, and less than a turn with work") {
  Results results = some_results();
  CHECK(results.harness->ping_us > 0.0);
  volatile double sink = 0.0;
  const double busy_s = turn_s([&](int i) {
    for (int k = 0; k < 100'000; ++k) sink = sink + i;
  });
  CHECK(1e-6 * results.harness->ping_us < busy_s / turn_pings);
  results.cells[0].ping_ms.median = 2e-3 * results.harness->ping_us;
  const Harness too_much = measure_harness(results.cells);
  CHECK(too_much.share() > Harness::max_share);
  CHECK(too_much.fastest_ping_us == Approx(2.0 * results.harness->ping_us));
}

TEST_CASE("A stop watch's laps add up to the time between its start and its last lap") {
  const engine::Clock::time_point before = engine::Clock::now();
  engine::StopWatch watch;
  const engine::Clock::time_point begun = engine::Clock::now();
  double stages_s[3] = {};
  engine::Clock::time_point last = begun;
  for (int i = 0; i < 3000; ++i) {
    last = engine::Clock::now();
    watch.lap(stages_s[i % 3]);
  }
  const double sum_s = stages_s[0] + stages_s[1] + stages_s[2];
  CHECK(sum_s <= engine::seconds_since(before) + 1e-9);
  CHECK(sum_s >= std::chrono::duration<double>(last - begun).count() - 1e-9);
}

TEST_CASE("The timed recipe is the one in scenes/") {
  std::ifstream file(tests::source_folder() / "scenes" / "target_recognition.toml");
  std::ostringstream text;
  text << file.rdbuf();
  CHECK(text.str().size() > 1000);
  CHECK(target_recipe == text.str());
}
