// A gain that changes from ping to ping, and bright samples that do not last.

#include <cmath>
#include <random>
#include <span>
#include <vector>

#include "support/catch.h"

#include "made_line.h"

#include <ensonify/engine/imitation/bed_levels.h>
#include <ensonify/engine/imitation/ping_gains.h>

using namespace ensonify;
using namespace ensonify::engine;
using tests::made_line;
using tests::samples;

namespace {

/// Multiplies both sides of each ping by a normal factor of this relative standard deviation.
void change_gain(RecordedLine& line, double deviation) {
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  for (std::size_t ping = 0; ping < line.pings.size(); ++ping) {
    const auto factor = static_cast<float>(std::exp(deviation * normal(random)));
    for (std::vector<float>* side : {&line.port, &line.starboard})
      for (float& value : std::span(*side).subspan(ping * samples, samples)) value *= factor;
  }
}

}  // namespace

TEST_CASE("a gain from ping to ping is found as large as it is, and can be taken off") {
  for (const TransferCurve curve :
       {TransferCurve::linear, TransferCurve::square_root, TransferCurve::logarithmic}) {
    CAPTURE(static_cast<int>(curve));
    RecordedLine line = made_line({.pings = 800, .altitude_m = &tests::varied_m});
    RecorderSigns recorder = recorder_signs(LineWithBed(line));
    change_gain(line, 0.1);
    recorder.curve = curve;
    for (std::vector<float>* side : {&line.port, &line.starboard})
      for (float& value : *side) {
        const double share = value / recorder.full_scale;
        if (curve == TransferCurve::square_root)
          value = static_cast<float>(recorder.full_scale * std::sqrt(share));
        if (curve == TransferCurve::logarithmic)
          value = static_cast<float>(recorder.full_scale *
                                     std::max(0.0, 1.0 + 20.0 * std::log10(std::max(share, 1e-9)) /
                                                             recorder.curve_range_db));
      }
    const PingGains found = ping_gains(LineWithBed(line), recorder);
    CHECK(found.rms_db == Approx(20.0 * std::log10(std::exp(0.1))).epsilon(0.1));
    REQUIRE(found.factors.size() == line.pings.size());
    CHECK(ping_gains(without_ping_gains(LineWithBed(line), found, recorder), recorder)
              .factors.empty());
  }
}

TEST_CASE("speckle, texture, ripples and an altitude that changes are no gain from ping to ping") {
  for (const tests::MadeLine& how :
       {tests::MadeLine{.pings = 800}, tests::MadeLine{.pings = 800, .texture = 0.5},
        tests::MadeLine{.pings = 800, .ripples = true},
        tests::MadeLine{.pings = 800, .altitude_m = &tests::varied_m, .spreading = 50.0}}) {
    const RecordedLine line = made_line(how);
    const RecorderSigns recorder = recorder_signs(LineWithBed(line));
    const PingGains found = ping_gains(LineWithBed(line), recorder);
    CHECK(found.rms_db == 0.0);
    CHECK(found.factors.empty());
    CHECK(without_ping_gains(LineWithBed(line), found, recorder).port == line.port);
  }
}

TEST_CASE("points of the bed last from ping to ping, single bright samples do not") {
  const auto with_peaks = [](std::size_t pings) {
    RecordedLine line = made_line({.pings = 800, .altitude_m = [](std::size_t) { return 4.0; }});
    std::mt19937 random(10);
    std::uniform_int_distribution<std::size_t> ping(0, 790), sample(100, samples - 1);
    for (int point = 0; point < 1000; ++point) {
      const std::size_t first = ping(random), k = sample(random);
      for (std::size_t i = first; i < first + pings; ++i)
        line.starboard[i * samples + k] = 30000.0f;
    }
    return lasting_peaks(LineWithBed(line));
  };
  CHECK(std::isnan(with_peaks(0)));
  CHECK(with_peaks(1) < 0.05);
  // Of the pings that see a point, all but the first and the last have two such neighbours.
  CHECK(with_peaks(5) > 0.7);
}
