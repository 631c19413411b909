// Recorders that even the level over range, on lines whose numbers are known.

#include <algorithm>
#include <cmath>
#include <vector>

#include "support/catch.h"

#include "made_line.h"

#include <ensonify/engine/comparison/find_bed.h>
#include <ensonify/engine/imitation/bed_levels.h>
#include <ensonify/engine/imitation/vehicle_path.h>
#include <ensonify/engine/recording/recording_reader.h>

using namespace ensonify;
using namespace ensonify::engine;
using tests::made_line;
using tests::MadeLine;
using tests::samples;
using tests::varied_m;

namespace {

constexpr float even_level = 4000.0f, full_scale = 32767.0f;

float rounded(double value) {
  return static_cast<float>(std::lround(std::min<double>(value, full_scale)));
}

/// Each sample over the mean of its range; of all pings, or a running mean over some.
RecordedLine with_even_ranges(RecordedLine line, double pings_of_mean) {
  for (std::vector<float>* side : {&line.port, &line.starboard})
    for (std::size_t k = 0; k < samples; ++k) {
      double mean = 0.0;
      for (std::size_t i = 0; i < line.pings.size(); ++i)
        mean += (*side)[i * samples + k] / static_cast<double>(line.pings.size());
      for (std::size_t i = 0; i < line.pings.size(); ++i) {
        float& value = (*side)[i * samples + k];
        if (pings_of_mean > 0.0) mean += (value - mean) / pings_of_mean;
        value = rounded(value / std::max(mean, 1.0) * even_level);
      }
    }
  return line;
}

/// Each sample over the mean of those within `reach` of it, in the same ping.
RecordedLine with_even_stretches(RecordedLine line, std::size_t reach) {
  for (std::vector<float>* side : {&line.port, &line.starboard})
    for (std::size_t i = 0; i < line.pings.size(); ++i) {
      const auto first_of_row = side->begin() + static_cast<std::ptrdiff_t>(i * samples);
      const std::vector<float> row(first_of_row, first_of_row + samples);
      for (std::size_t k = 0; k < samples; ++k) {
        const std::size_t first = k < reach ? 0 : k - reach, end = std::min(k + reach + 1, samples);
        double mean = 0.0;
        for (std::size_t near = first; near < end; ++near)
          mean += row[near] / static_cast<double>(end - first);
        (*side)[i * samples + k] = rounded(row[k] / std::max(mean, 1.0) * even_level);
      }
    }
  return line;
}

RecordedLine at_altitudes(RecordedLine line, double (*altitude_m)(std::size_t)) {
  for (std::size_t i = 0; i < line.pings.size(); ++i) line.pings[i].altitude_m = altitude_m(i);
  return line;
}

}  // namespace

TEST_CASE("an automatic gain that evens each range is known, and the stated altitude counts") {
  for (const double pings_of_mean : {0.0, 30.0}) {
    CAPTURE(pings_of_mean);
    const auto eight_m = +[](std::size_t) { return 8.0; };
    const RecordedLine line =
        at_altitudes(with_even_ranges(made_line({.spreading = 20.0}), pings_of_mean), eight_m);
    const RecorderSigns signs = recorder_signs(LineWithBed(line));
    CHECK(signs.even_ranges);
    CHECK(signs.column_from.how == Confidence::assumed);
    CHECK(std::isnan(range_slope_db(LineWithBed(line), signs)));
    const VehiclePath path = vehicle_path(LineWithBed(line));
    CHECK(path.altitude.how == Confidence::stated);
    for (const double altitude_m : path.altitude_m) CHECK(altitude_m == Approx(8.0).margin(0.3));
    CHECK_THROWS_WITH(vehicle_path(LineWithBed(with_even_ranges(made_line({}), pings_of_mean))),
                      Catch::Contains("equally bright at all ranges") &&
                          Catch::Contains("a recording without automatic gain"));
  }
}

TEST_CASE("an automatic gain that evens parts of each ping is known") {
  for (const std::size_t reach : {20u, 60u}) {
    CAPTURE(reach);
    const RecordedLine line =
        with_even_stretches(made_line({.spreading = 20.0, .texture = 0.5}), reach);
    const RecorderSigns signs = recorder_signs(LineWithBed(line));
    CHECK_FALSE(signs.even_ranges);
    CHECK(signs.even_samples > 0);
    CHECK(signs.even_samples <= 4 * reach);
  }
}

TEST_CASE("no other line seems to have an automatic gain") {
  for (const MadeLine& how :
       {MadeLine{}, MadeLine{.altitude_m = &varied_m}, MadeLine{.looks = 4, .spreading = 40.0},
        MadeLine{.column = 0.05}, MadeLine{.ping_mean = 0.2}, MadeLine{.level = 0.4},
        MadeLine{.logarithmic = true}, MadeLine{.square_root = true}, MadeLine{.texture = 0.5},
        MadeLine{.ripples = true}}) {
    CAPTURE(how.looks, how.spreading, how.column, how.ping_mean, how.level, how.texture,
            how.ripples);
    const RecorderSigns signs = recorder_signs(LineWithBed(made_line(how)));
    CHECK_FALSE(signs.even_ranges);
    CHECK(signs.even_samples == 0);
  }
}
