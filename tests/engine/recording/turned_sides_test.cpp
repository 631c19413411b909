// Sides whose samples are in the other order than the format says.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "support/catch.h"
#include "support/data.h"
#include "support/small_recording.h"

#include <ensonify/engine/output/jsf.h>
#include <ensonify/engine/output/xtf.h>
#include <ensonify/engine/recording/recording_reader.h>
#include <ensonify/engine/recording/sides.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

constexpr std::size_t side_pings = 64, side_samples = 500;

/// Rayleigh amplitudes with this rms over the share of the range.
std::vector<float> rows_of(const std::function<double(double share)>& rms) {
  std::mt19937 random(5);
  std::exponential_distribution<double> power;
  std::vector<float> rows;
  for (std::size_t i = 0; i < side_pings * side_samples; ++i)
    rows.push_back(
        static_cast<float>(1e4 * rms((static_cast<double>(i % side_samples) + 0.5) / side_samples) *
                           std::sqrt(power(random))));
  return rows;
}

RecordedLine line_of_sides(std::vector<float> port, std::vector<float> starboard = {}) {
  RecordedLine line{.samples = side_samples};
  for (std::size_t i = 0; i < side_pings; ++i)
    line.pings.push_back({.number = i, .range_m = 50.0, .samples = side_samples});
  line.port = std::move(port);
  line.starboard = std::move(starboard);
  return line;
}

std::vector<float> reversed(std::vector<float> rows) {
  for (auto row = rows.begin(); row != rows.end(); row += side_samples)
    std::reverse(row, row + side_samples);
  return rows;
}

/// A burst, the water column, and a bed whose level falls with range^-fall down to a floor.
std::vector<float> bed(double altitude, double fall, double floor = 0.01) {
  return rows_of([=](double share) {
    if (share < 0.01) return 1.0;
    return share < altitude ? floor : std::max(floor, 0.3 * std::pow(share / altitude, -fall));
  });
}

}  // namespace

TEST_CASE("a side whose water column lies at its far end is turned, with a warning") {
  for (const double altitude : {0.08, 0.2, 0.4}) {
    CAPTURE(altitude);
    const std::vector<float> right = bed(altitude, 1.0);
    RecordedLine line = line_of_sides(reversed(right), right);
    turn_reversed_sides(line, "r");
    CHECK(line.port == right);
    CHECK(line.starboard == right);
    REQUIRE(line.warnings.size() == 1);
    CHECK_THAT(line.warnings[0],
               Catch::StartsWith("r: the samples of port ") && Catch::EndsWith("turned"));
    line = line_of_sides({}, reversed(right));  // the other side alone
    turn_reversed_sides(line, "r");
    CHECK(line.starboard == right);
  }
}

TEST_CASE("an XTF or JSF whose port is stored the other way is read near to far") {
  Recording written = tests::small_recording(side_samples);
  const NavPing first = written.pings.front();
  const std::vector<float> right = bed(0.2, 1.0);
  written.pings.clear();
  written.samples.clear();
  written.gain_db.resize(side_pings);
  for (std::size_t row = 0; row < side_pings; ++row) {
    written.pings.push_back(first);
    written.pings.back().row = row;
    written.pings.back().number += row;
    written.pings.back().unix_ms += 100 * static_cast<int>(row);
    for (int side = 0; side < 2; ++side)  // of port, the first sample should be the farthest
      for (std::size_t k = 0; k < side_samples; ++k)
        written.samples.push_back(static_cast<std::uint16_t>(right[row * side_samples + k]));
  }
  for (const bool jsf : {false, true}) {
    CAPTURE(jsf);
    const RecordedLine line =
        parse_recording(jsf ? encode_jsf({&written, 1}) : encode_xtf({&written, 1}), "r").front();
    CHECK(line.port == line.starboard);
    REQUIRE(line.warnings.size() == 1);
    CHECK_THAT(line.warnings.front(), Catch::StartsWith("r: the samples of port are in the other"));
  }
}

TEST_CASE("samples before the recorded ones stay where they are") {
  constexpr std::size_t unrecorded = 40;
  std::vector<float> right = bed(0.3, 1.0);
  for (std::size_t ping = 0; ping < side_pings; ++ping)
    std::fill_n(right.begin() + static_cast<std::ptrdiff_t>(ping * side_samples), unrecorded, 0.0f);
  RecordedLine line = line_of_sides(right);
  for (std::size_t ping = 0; ping < side_pings; ++ping) {
    const auto row = line.port.begin() + static_cast<std::ptrdiff_t>(ping * side_samples);
    std::reverse(row + unrecorded, row + side_samples);
    line.pings[ping].unrecorded = unrecorded;
  }
  turn_reversed_sides(line, "r");
  CHECK(line.port == right);
}

TEST_CASE("a side in the right order stays, whatever its far end looks like") {
  const std::vector<std::function<double(double)>> levels{
      [](double) { return 0.1; },  // no column
      [](double share) { return share < 0.01 ? 1.0 : 0.3 * std::pow(share / 0.02, -2.0); },  // low
      [](double share) { return share < 0.15 || share > 0.6 ? 0.01 : 0.3; },  // a bank's shadow
      [](double share) { return share < 0.15 || share > 0.9 ? 0.02 : 0.3; },  // the last echo
      [](double share) { return share < 0.15  ? 0.02
                                : share < 0.8 ? 0.1
                                              : 0.9; },  // a quay
      [](double share) { return 0.01 + 0.2 * share; },  // noise after a gain
      [](double) { return 0.0; }};
  for (std::size_t i = 0; i < levels.size(); ++i) {
    CAPTURE(i);
    const std::vector<float> rows = rows_of(levels[i]);
    RecordedLine line = line_of_sides(rows, rows);
    turn_reversed_sides(line, "r");
    CHECK(line.port == rows);
    CHECK(line.warnings.empty());
  }
  for (const double fall : {0.0, 1.0, 2.0})
    for (const double altitude : {0.03, 0.1, 0.3, 0.55}) {
      CAPTURE(fall, altitude);
      RecordedLine line = line_of_sides(bed(altitude, fall));
      turn_reversed_sides(line, "r");
      CHECK(line.warnings.empty());
    }
}

TEST_CASE("real recordings are in the right order, and are turned back if they are turned") {
  for (const char* name : {"sidescan/scotsman-iver2.xtf", "sidescan/river-1236.xtf"}) {
    const auto file = tests::data_file(name);
    if (!file) {
      WARN("skipped: the recording is not there");
      return;
    }
    const RecordedLine sound = read_recording(*file).front();
    CHECK(std::ranges::none_of(sound.warnings, [](const std::string& warning) {
      return warning.find("in the other order") != std::string::npos;
    }));
    RecordedLine line = sound;
    for (std::vector<float>* side : {&line.port, &line.starboard})
      for (std::size_t i = 0; i < line.pings.size(); ++i)
        std::reverse(
            side->begin() + static_cast<std::ptrdiff_t>(i * line.samples),
            side->begin() + static_cast<std::ptrdiff_t>(i * line.samples + line.pings[i].samples));
    turn_reversed_sides(line, name);
    CHECK(line.port == sound.port);
    CHECK(line.starboard == sound.starboard);
  }
}
