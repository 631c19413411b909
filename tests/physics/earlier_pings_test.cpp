// Times and levels of echoes of earlier pings, from beyond the range.

#include <algorithm>
#include <cmath>
#include <vector>

#include "support/catch.h"
#include "support/lines.h"
#include "support/other_paths.h"

#include <ensonify/scatter/decibel.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

TEST_CASE("the ping before is heard from c P / 2 farther, by the sonar equation") {
  const Sonar sonar = open_sonar();
  const double ping_m = 90.0, interval_s = 2.0 * ping_m / 1500.0;
  const auto lambert = [](double sine) { return 2e-3 * sine * sine; };
  const std::vector<double> all = received(sonar, {.second_time_around = true}, {}, {},
                                           {.strength = lambert, .ping_interval_s = interval_s});
  const auto level = [&](double from_m) {
    const double sine = altitude_m / from_m;
    const double width = 2.0 / 3.0 * 1500.0 / sonar.frequency_hz / sonar.array_length_m;
    const double area_m2 =
        from_m * width * sonar.pulse.cell_m(1500.0) / std::sqrt(1.0 - sine * sine);
    return scatter::from_db(sonar.source_level_db - 40.0 * std::log10(from_m) -
                            2.0 * 0.03 * from_m) *
           area_m2 * lambert(sine);
  };
  for (const double r : {1.0, 20.0, 50.0, 74.0}) {
    double expected = 0.0;
    for (int pings = 1; pings <= 4; ++pings) expected += level(r + pings * ping_m);
    CAPTURE(r);
    CHECK(scatter::to_db(all[static_cast<std::size_t>(r / sonar.bin_m())]) ==
          Approx(scatter::to_db(expected)).epsilon(0).margin(0.05));
  }
  // Without a given interval, the interval is the two-way time of the range, 75 m. By default there
  // is no echo of earlier pings.
  const std::vector<double> at_once =
      received(sonar, {.second_time_around = true}, {}, {}, {.strength = lambert});
  CHECK(scatter::to_db(at_once[100] / (level(80.0) + level(155.0))) == Approx(0.0).margin(0.1));
  for (const double none : received(sonar, {}, {}, {}, {.strength = lambert})) REQUIRE(none == 0.0);
  // Far below the noise nothing is added.
  Sonar noisy = sonar;
  noisy.receiver.noise = true;
  const auto without = received(noisy, {}, {}, {}, {.strength = lambert});
  CHECK(received(noisy, {.second_time_around = true}, {}, {},
                 {.strength = lambert, .ping_interval_s = 4.0}) == without);
  CHECK(received(noisy, {.second_time_around = true}, {}, {}, {.strength = lambert})[0] >
        without[0]);
}

TEST_CASE("the first cells of the ping before have the energy of the places that lie in them") {
  // The bed is deeper than half the way that sound covers between two pings, so these cells are
  // below the array. The sum is over the bed on one side.
  Sonar sonar = open_sonar();
  sonar.range_m = 7.5;
  sonar.frequency_hz = 100e3;
  sonar.array_length_m = 2.0;
  const double ping_m = 8.0, bin_m = sonar.bin_m();
  const LineArray line{sonar.array_length_m, 1500.0 / sonar.frequency_hz};
  const auto lambert = [](double sine) { return 2e-3 * sine * sine; };
  Pulse cw, brief, sweep;
  cw.length_s = 4e-4;
  brief.length_s = 2e-5;
  sweep.kind = PulseKind::lfm;
  sweep.bandwidth_hz = 3e3;
  for (const Pulse& pulse : {cw, brief, sweep}) {
    sonar.pulse = pulse;
    const double cell_m = sonar.pulse.cell_m(1500.0), length_m = std::max(cell_m, bin_m);
    const std::vector<double> heard =
        received(sonar, {.second_time_around = true}, {}, {},
                 {.strength = lambert, .ping_interval_s = 2.0 * ping_m / 1500.0});
    const double behind_m = pulse.kind == PulseKind::cw ? 0.5 * cell_m : 0.0;
    std::vector<double> expected(heard.size());
    constexpr double step_m = 0.004;
    for (double x_m = 0.5 * step_m; std::hypot(x_m, altitude_m) < 5.0 * ping_m; x_m += step_m) {
      const double reach_m = 1.1 * std::hypot(x_m, altitude_m) * line.null_rad(1);
      constexpr int points = 100;
      for (int i = 0; i < points; ++i) {
        const double y_m = ((2.0 * i + 1.0) / points - 1.0) * reach_m;
        const double range_m = std::hypot(x_m, y_m, altitude_m), along = y_m / range_m;
        if (std::abs(along) > line.null_rad(1)) continue;
        const double area_m2 = step_m * 2.0 * reach_m / points;
        const double intensity = cell_m / length_m * area_m2 * lambert(altitude_m / range_m) *
                                 std::pow(line.power(along), 2) *
                                 scatter::from_db(sonar.source_level_db - 2.0 * 0.03 * range_m) /
                                 std::pow(range_m, 4);
        for (int pings = 1; pings <= 4; ++pings) {
          const double at_m = range_m - pings * ping_m + behind_m - 0.5 * length_m;
          const double first = at_m / bin_m - 0.5;
          for (double n = std::ceil(first); n < first + length_m / bin_m; n += 1.0)
            if (n >= 0.0 && n < static_cast<double>(expected.size()))
              expected[static_cast<std::size_t>(n)] += intensity;
        }
      }
    }
    double begin_m = 1.0;
    for (const double until_m : {altitude_m - ping_m + behind_m, 2.5, 3.0, 4.0, 5.5}) {
      double sum = 0.0, its = 0.0;
      for (std::size_t n = 0; n < expected.size(); ++n) {
        const double range_m = (static_cast<double>(n) + 0.5) * bin_m;
        if (range_m > begin_m && range_m < until_m) sum += heard[n], its += expected[n];
      }
      CAPTURE(cell_m, begin_m, until_m);
      CHECK(scatter::to_db(sum / its) == Approx(0.0).margin(0.2));
      begin_m = until_m;
    }
  }
}

TEST_CASE("the ping before has the width of the beam beyond the range") {
  // Out of focus a beam does not grow like the range, and behind a focus zone it grows faster. A
  // sonar with the same array and a longer range has the beam's width there, from its own table.
  struct Case {
    double length_m, receive_m, frequency_hz;
    std::vector<double> zones_m;
  };
  const double ping_m = 75.0;
  double max_db = 0.0;
  for (const Case& of : {Case{1.5, 0.0, 900e3, {}}, Case{1.0, 0.0, 400e3, {30.0}},
                         Case{1.0, 0.3, 400e3, {}}, Case{0.5, 0.0, 400e3, {}}}) {
    Sonar sonar = open_sonar();
    sonar.focused = false;
    sonar.array_length_m = of.length_m;
    sonar.receive_array_length_m = of.receive_m;
    sonar.frequency_hz = of.frequency_hz;
    sonar.focus_zones_m = of.zones_m;
    const std::vector<double> all = received(sonar, {.second_time_around = true}, {}, {},
                                             {.ping_interval_s = 2.0 * ping_m / 1500.0});
    // The integral of the exact patterns along the track.
    const LineArray sends = sonar.transmit_array(1500.0 / of.frequency_hz),
                    hears = sonar.receive_array(1500.0 / of.frequency_hz);
    const auto width_m = [&](double range_m) {
      const double reach_m = 0.5 * of.length_m * std::abs(sonar.defocus(range_m)) +
                             range_m * sends.null_rad(1);  // no rays go to the side lobes
      double sum = 0.0;
      for (int i = 0; i < 4000; ++i) {
        const double y = (i + 0.5) * reach_m / 4000.0;
        sum += sends.power(y / range_m, range_m, sonar.defocus(range_m)) *
               hears.power(y / range_m, range_m, sonar.defocus(range_m));
      }
      return sum * 2.0 * reach_m / 4000.0;
    };
    for (const double r : {5.0, 30.0, 70.0}) {
      const auto bin = static_cast<std::size_t>(r / sonar.bin_m());
      double expected = 0.0, in_proportion = 0.0;
      for (int pings = 1; pings <= 8; ++pings) {
        const double from_m = (static_cast<double>(bin) + 0.5) * sonar.bin_m() -
                              0.5 * sonar.pulse.cell_m(1500.0) + pings * ping_m;
        const double level = std::sqrt(1.0 - std::pow(altitude_m / from_m, 2));
        const double per_width = scatter::from_db(sonar.source_level_db - 2.0 * 0.03 * from_m) /
                                 std::pow(from_m, 4) * sonar.pulse.cell_m(1500.0) / level * 3e-4;
        expected += per_width * width_m(from_m);
        in_proportion += per_width * width_m(sonar.range_m) * from_m / sonar.range_m;
      }
      CAPTURE(of.length_m, of.frequency_hz, r);
      CHECK(scatter::to_db(all[bin] / expected) == Approx(0.0).margin(0.1));
      max_db = std::max(max_db, std::abs(scatter::to_db(in_proportion / expected)));
    }
  }
  CHECK(max_db > 1.0);
}

TEST_CASE("the ping before is heard by an outer beam with that beam's width beyond the range") {
  Sonar sonar = open_sonar();
  sonar.range_m = 40.0;
  sonar.array_length_m = 0.15;
  sonar.receive_array_length_m = 0.3;
  sonar.beams = 3;
  sonar.beam_spacing_m = 0.6;
  sonar.side_lobes = 1;  // those of the receiver lie in the transmitter's main lobe
  const double ping_m = 40.0;
  const SignalChain chain(sonar, {.speckle = false,
                                  .ping_interval_s = 2.0 * ping_m / 1500.0,
                                  .nominal_strength = [](double) { return 3e-4; },
                                  .arrivals = {.second_time_around = true}});
  const auto heard = [&](int beam) {
    EchoLine line = level_line(sonar, starboard_sector, array, altitude_m);
    std::fill(line.bins.intensity_mean.begin(), line.bins.intensity_mean.end(), 0.0f);
    SignalChain::Scratch scratch;
    LineContext now = context;
    now.beam = line.beam = beam;
    receive_lines(chain, now, std::span(&line, 1), scratch);
    return std::vector<double>(line.bins.intensity.begin(), line.bins.intensity.end());
  };
  // The integral of both patterns along the track, with the receiver aside.
  const LineArray sends = sonar.transmit_array(1500.0 / sonar.frequency_hz),
                  hears = sonar.receive_array(1500.0 / sonar.frequency_hz);
  const auto width_m = [&](double range_m, double aside_m) {
    const double reach_m = aside_m + 5.0 * range_m * hears.null_rad(1), step_m = reach_m / 1e4;
    double sum = 0.0;
    for (double y_m = -reach_m + 0.5 * step_m; y_m < reach_m; y_m += step_m)
      sum += step_m * sends.power(y_m / range_m, range_m) *
             hears.power((y_m - aside_m) / range_m, range_m);
    return sum;
  };
  const std::vector<double> middle = heard(1), outer = heard(2);
  for (const double r : {2.0, 15.0, 38.0}) {
    const auto bin = static_cast<std::size_t>(r / sonar.bin_m());
    double its = 0.0, of_middle = 0.0;
    for (int pings = 1; pings <= 8; ++pings) {
      const double from_m = r + pings * ping_m;
      const double level = std::sqrt(1.0 - std::pow(altitude_m / from_m, 2));
      its += width_m(from_m, 0.6) / (std::pow(from_m, 4) * level);
      of_middle += width_m(from_m, 0.0) / (std::pow(from_m, 4) * level);
    }
    CAPTURE(r);
    CHECK(scatter::to_db(outer[bin] / middle[bin]) ==
          Approx(scatter::to_db(its / of_middle)).epsilon(0).margin(0.1));
  }
}

TEST_CASE("along a pitched array the ping before covers more of the bed, by 1 / cos(pitch)") {
  const Sonar sonar = open_sonar();
  const double pitch_rad = 0.6, ping_m = 90.0;
  const Eigen::Vector3d ahead{0.0, std::cos(pitch_rad), std::sin(pitch_rad)};
  const auto heard = [&](const ArrayFrame& array_frame) {
    return received(sonar, {.second_time_around = true}, {}, {},
                    {.array_frame = array_frame, .ping_interval_s = 2.0 * ping_m / 1500.0});
  };
  const std::vector<double> level = heard(context.array),
                            pitched = heard({array, ahead, {0.0, ahead.z(), -ahead.y()}});
  for (const double r : {5.0, 70.0}) {
    const auto bin = static_cast<std::size_t>(r / sonar.bin_m());
    // Of a strip of bed the cut with the plane abeam is also longer, by its angle to the ray.
    const auto cut = [&](double height_m) {
      return std::sqrt(1.0 - std::pow(height_m / (r + ping_m), 2));
    };
    CHECK(scatter::to_db(pitched[bin] / level[bin]) ==
          Approx(scatter::to_db(cut(altitude_m) / cut(altitude_m / std::cos(pitch_rad)) /
                                std::cos(pitch_rad)))
              .epsilon(0)
              .margin(0.02));
  }
}
