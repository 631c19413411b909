// The map of darker and brighter bed of a line.

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "support/catch.h"

#include "made_line.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/imitation/tone_map.h>
#include <ensonify/engine/imitation/vehicle_path.h>

using namespace ensonify;
using namespace ensonify::engine;
using tests::made_line;
using tests::samples;
using tests::varied_m;

TEST_CASE("a darker part of the bed is on the map of tones where it is") {
  RecordedLine line = made_line({.pings = 800});
  VehiclePath path = vehicle_path(LineWithBed(line));
  for (std::size_t i = 0; i < 800; ++i) path.y_m[i] = 0.1 * (static_cast<double>(i) - 400.0);
  CHECK(tone_map(LineWithBed(line), path, recorder_signs(LineWithBed(line)), 0.0, 104.0, 184.0)
            .steps.empty());
  // 12 dB darker to starboard in the northern half: the line goes north.
  for (std::size_t ping = 400; ping < 800; ++ping)
    for (std::size_t k = 90; k < samples; ++k) line.starboard[ping * samples + k] *= 0.25f;
  const ToneMap map =
      tone_map(LineWithBed(line), path, recorder_signs(LineWithBed(line)), 0.0, 104.0, 184.0);
  REQUIRE(map.steps.size() == map.columns * map.rows);
  // The mean over 21 x 21 pixels, because a level between two steps gets either of the two steps.
  const auto tone_db_at = [](const ToneMap& of, double east_m, double north_m) {
    const auto column = static_cast<std::size_t>((east_m / 104.0 + 0.5) * double(of.columns));
    const auto row = static_cast<std::size_t>((0.5 - north_m / 184.0) * double(of.rows));
    double sum_db = 0.0;
    for (std::size_t r = row - 10; r <= row + 10; ++r)
      for (std::size_t c = column - 10; c <= column + 10; ++c)
        sum_db += ToneMap::step_db * of.steps[r * of.columns + c];
    return sum_db / (21.0 * 21.0);
  };
  // The mean of both halves lies between them, by 6 dB each.
  const auto check = [&](const ToneMap& of) {
    CHECK(tone_db_at(of, 30.0, 20.0) == Approx(-6.0).margin(0.5));
    CHECK(tone_db_at(of, 30.0, -20.0) == Approx(6.0).margin(0.5));
    CHECK(tone_db_at(of, -30.0, 20.0) == Approx(0.0).margin(0.5));
    CHECK(tone_db_at(of, -30.0, -20.0) == Approx(0.0).margin(0.5));
  };
  check(map);
  // A recorder's square root does not halve them.
  RecorderSigns root = recorder_signs(LineWithBed(line));
  root.curve = TransferCurve::square_root;
  root.full_scale = 32767.0;
  for (std::vector<float>* side : {&line.port, &line.starboard})
    for (float& sample : *side) sample = std::sqrt(32767.0f * sample);
  const ToneMap of_root = tone_map(LineWithBed(line), path, root, 0.0, 104.0, 184.0);
  REQUIRE(of_root.steps.size() == map.steps.size());
  check(of_root);
}

TEST_CASE("a tone that changes slowly has no borders") {
  RecordedLine line = made_line({.pings = 800});
  VehiclePath path = vehicle_path(LineWithBed(line));
  for (std::size_t i = 0; i < 800; ++i) path.y_m[i] = 0.1 * (static_cast<double>(i) - 400.0);
  // To starboard from -6 to 6 dB along the line.
  for (std::size_t ping = 0; ping < 800; ++ping)
    for (std::size_t k = 90; k < samples; ++k)
      line.starboard[ping * samples + k] *=
          static_cast<float>(std::pow(10.0, (0.015 * static_cast<double>(ping) - 6.0) / 20.0));
  const ToneMap map =
      tone_map(LineWithBed(line), path, recorder_signs(LineWithBed(line)), 0.0, 104.0, 184.0);
  REQUIRE(map.steps.size() == map.columns * map.rows);
  // The mean over 20 m of each row of pixels, from east to west, follows the change.
  const double north_side_m = 184.0 / static_cast<double>(map.rows);
  for (double north_m = -35.0; north_m < 35.0; north_m += 1.0) {
    CAPTURE(north_m);
    const auto row = static_cast<std::size_t>((92.0 - north_m) / north_side_m);
    const std::size_t first = map.columns * 72 / 104, end = map.columns * 92 / 104;
    double sum_db = 0.0;
    for (std::size_t c = first; c < end; ++c)
      sum_db += ToneMap::step_db * map.steps[row * map.columns + c];
    CHECK(sum_db / static_cast<double>(end - first) == Approx(0.15 * north_m).margin(0.9));
  }
}

TEST_CASE("gain over range on a changing altitude makes no tones") {
  // At each angle the level changes by 20 dB per factor of ten in range, here by 10 dB.
  const RecordedLine line = made_line({.pings = 800, .altitude_m = &varied_m, .spreading = 50.0});
  VehiclePath path = vehicle_path(LineWithBed(line));
  for (std::size_t i = 0; i < 800; ++i) path.y_m[i] = 0.1 * (static_cast<double>(i) - 400.0);
  const RecorderSigns recorder = recorder_signs(LineWithBed(line));
  const double slope_db = range_slope_db(LineWithBed(line), recorder);
  CHECK(slope_db == Approx(20.0).margin(1.0));
  CHECK(tone_map(LineWithBed(line), path, recorder, slope_db, 104.0, 184.0).steps.empty());
  CHECK_FALSE(tone_map(LineWithBed(line), path, recorder, 0.0, 104.0, 184.0).steps.empty());
}

TEST_CASE("a single bright object is no tone, and its place is named") {
  RecordedLine line = made_line({.pings = 800});
  VehiclePath path = vehicle_path(LineWithBed(line));
  for (std::size_t i = 0; i < 800; ++i) path.y_m[i] = 0.1 * (static_cast<double>(i) - 400.0);
  const RecorderSigns recorder = recorder_signs(LineWithBed(line));
  CHECK(bright_objects(LineWithBed(line), path, recorder).empty());
  // A darker half, so that there are tones.
  for (std::size_t ping = 400; ping < 800; ++ping)
    for (std::size_t k = 90; k < samples; ++k) line.starboard[ping * samples + k] *= 0.25f;
  const ToneMap without = tone_map(LineWithBed(line), path, recorder, 0.0, 104.0, 184.0);
  REQUIRE_FALSE(without.steps.empty());
  CHECK(bright_objects(LineWithBed(line), path, recorder).empty());
  for (std::size_t ping = 200; ping < 212; ++ping)
    for (std::size_t k = 250; k < 280; ++k) {
      line.port[ping * samples + k] = 20000.0f;
      line.port[ping * samples + k + 40] = 1.0f;  // its shadow
    }
  const std::vector<BrightObject> objects = bright_objects(LineWithBed(line), path, recorder);
  REQUIRE(objects.size() == 1);
  CHECK(objects[0].side == Side::port);
  CHECK(objects[0].ping >= 198);
  CHECK(objects[0].ping <= 214);
  CHECK(objects[0].range_m == Approx(26.5).margin(1.6));
  CHECK(objects[0].over_bed_db > 10.0);
  const ToneMap with = tone_map(LineWithBed(line), path, recorder, 0.0, 104.0, 184.0);
  REQUIRE(with.steps.size() == without.steps.size());
  // Around the object, which lies at 26.5 m of range in pings 200 to 211.
  double change_db = 0.0, pixels = 0.0;
  for (std::size_t row = 0; row < with.rows; ++row)
    for (std::size_t column = 0; column < with.columns; ++column) {
      const double east_m =
          104.0 * ((static_cast<double>(column) + 0.5) / double(with.columns) - 0.5);
      const double north_m = 184.0 * (0.5 - (static_cast<double>(row) + 0.5) / double(with.rows));
      if (std::hypot(east_m + std::sqrt(26.5 * 26.5 - 64.0), north_m + 19.4) > 2.5) continue;
      const std::size_t i = row * with.columns + column;
      change_db += ToneMap::step_db * (with.steps[i] - without.steps[i]);
      pixels += 1.0;
    }
  CHECK(pixels > 50.0);
  CHECK(std::abs(change_db / pixels) < 0.5);
}
