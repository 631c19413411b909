// What the samples of a line show of its recorder.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "support/catch.h"

#include "made_line.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/imitation/bed_levels.h>
#include <ensonify/engine/imitation/vehicle_path.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify;
using namespace ensonify::engine;
using tests::made_line;
using tests::range_m;
using tests::sample_m;
using tests::samples;
using tests::varied_m;

TEST_CASE("the contrast of speckle is that of Rayleigh amplitudes") {
  CHECK(speckle_of(Detector::mean, 1).contrast == Approx(0.52272).epsilon(1e-4));
  CHECK(speckle_of(Detector::mean, 4).contrast == Approx(0.26136).epsilon(1e-4));
  CHECK(speckle_of(Detector::peak, 1).contrast == Approx(0.52272).epsilon(1e-3));
  // A Monte Carlo check: the largest of three powers, from many draws.
  std::mt19937 random(1);
  std::exponential_distribution<double> power;
  double sum = 0.0, squares = 0.0;
  constexpr int draws = 200000;
  for (int i = 0; i < draws; ++i) {
    const double largest = std::max({power(random), power(random), power(random)});
    sum += std::sqrt(largest) / draws;
    squares += largest / draws;
  }
  CHECK(speckle_of(Detector::peak, 3).contrast ==
        Approx(std::sqrt(squares - sum * sum) / sum).epsilon(0.01));
}

TEST_CASE("the samples show looks, detector, scaled pings, curve, floor and clipping") {
  for (const int looks : {1, 4}) {
    const RecorderSigns signs = recorder_signs(LineWithBed(made_line({.looks = looks})));
    CHECK(signs.looks == looks);
    CHECK(signs.detector == Detector::mean);
    CHECK(signs.curve == TransferCurve::linear);
    CHECK(signs.bits <= 15);
    CHECK_FALSE(signs.clips);
    if (looks == 1)
      CHECK(signs.column_db ==
            Approx(-60.0 + 20.0 * std::log10(32767.0 / signs.full_scale)).margin(1.0));
  }
  // Texture adds to the contrast. The contrast of 3 looks is still the nearest.
  CHECK(recorder_signs(LineWithBed(made_line({.looks = 3, .texture = 0.12}))).looks == 3);
  const RecorderSigns peak = recorder_signs(LineWithBed(made_line({.looks = 3, .peak = true})));
  CHECK(peak.detector == Detector::peak);
  CHECK(peak.looks == 3);
  // The altitude changes the share of water, and with it the mean, unless each ping is scaled.
  const RecorderSigns scaled =
      recorder_signs(LineWithBed(made_line({.altitude_m = &varied_m, .ping_mean = 0.25})));
  CHECK(scaled.ping_mean == Approx(0.25).epsilon(0.03));  // without the first 2 % of the samples
  CHECK(scaled.clips);
  CHECK(scaled.bits == 15);
  CHECK(recorder_signs(LineWithBed(made_line({.altitude_m = &varied_m}))).ping_mean == 0.0);
  // On an even bed at a constant altitude the means are alike without any scale.
  CHECK(recorder_signs(LineWithBed(made_line({.looks = 8}))).ping_mean == 0.0);
  const RecorderSigns noiseless = recorder_signs(LineWithBed(made_line({.column = 0.0})));
  CHECK(noiseless.column_from.how == Confidence::assumed);
  CHECK(noiseless.column_db < scatter::amplitude_to_db(0.5 / 32767.0));
  // A recorder without a logarithm, whose spread hardly grows with the mean.
  const RecorderSigns rippled =
      recorder_signs(LineWithBed(made_line({.looks = 4, .ripples = true})));
  CHECK(rippled.curve == TransferCurve::linear);
  CHECK(rippled.looks == 4);
  const RecorderSigns logarithmic =
      recorder_signs(LineWithBed(made_line({.spreading = 15.0, .logarithmic = true})));
  CHECK(logarithmic.curve == TransferCurve::logarithmic);
  CHECK(logarithmic.curve_range_db == Approx(80.0).epsilon(0.15));
}

TEST_CASE("a contrast somewhat under that of one look is one look, not two") {
  // Two looks would have 0.37, and leave a seventh of the recording's contrast to texture.
  RecordedLine line = made_line({});
  const double mean = 0.1 * 32767.0 * 0.5 * std::sqrt(std::numbers::pi);
  for (std::vector<float>* side : {&line.port, &line.starboard})
    for (std::size_t i = 0; i < side->size(); ++i)
      if (float& value = (*side)[i]; i % samples > 80)
        value = static_cast<float>(std::round(mean + 0.92 * (value - mean)));
  const RecorderSigns signs = recorder_signs(LineWithBed(line));
  CHECK(signs.looks == 1);
  CHECK_FALSE(signs.looks_from.at_limit);
  CHECK(recorder_signs(LineWithBed(made_line({.looks = 30}))).looks_from.at_limit);
}

TEST_CASE("bright samples at the beginning are a burst only if they are as bright as one") {
  for (const double share : {1.0, 0.02}) {
    CAPTURE(share);
    RecordedLine line = made_line({});
    for (std::vector<float>* side : {&line.port, &line.starboard})
      for (std::size_t i = 0; i < side->size(); ++i)
        if (i % samples < 10) (*side)[i] = static_cast<float>(std::floor(32767.0 * share));
    const RecorderSigns signs = recorder_signs(LineWithBed(line));
    CHECK((signs.burst_m > 0.0) == (share == 1.0));
    CHECK(signs.burst_from.why.ends_with("left out") == (share < 1.0));
  }
}

TEST_CASE("the skew of decibels shows the looks of a logarithmic recorder, and they its range") {
  // The expected values are from many draws, and for one look from the Gumbel distribution.
  CHECK(speckle_of(Detector::mean, 1, TransferCurve::logarithmic).contrast ==
        Approx(5.57).epsilon(1e-3));
  CHECK(speckle_of(Detector::mean, 1, TransferCurve::logarithmic).skew ==
        Approx(-1.1395).epsilon(2e-3));
  std::mt19937 random(2);
  std::exponential_distribution<double> power;
  constexpr int draws = 200000;
  for (const bool peak : {false, true}) {
    double sum = 0.0, squares = 0.0, cubes = 0.0;
    for (int i = 0; i < draws; ++i) {
      const double one = std::sqrt(power(random)), other = std::sqrt(power(random)),
                   db = 20.0 * std::log10(peak ? std::max(one, other) : 0.5 * (one + other));
      sum += db / draws;
      squares += db * db / draws;
      cubes += db * db * db / draws;
    }
    const double variance = squares - sum * sum;
    const Speckle two =
        speckle_of(peak ? Detector::peak : Detector::mean, 2, TransferCurve::logarithmic);
    CAPTURE(peak);
    CHECK(two.contrast == Approx(std::sqrt(variance)).epsilon(0.02));
    CHECK(two.skew == Approx((cubes - sum * (3.0 * variance + sum * sum)) / std::pow(variance, 1.5))
                          .epsilon(0.05));
  }
  // The level of the bed is constant over range, or it changes.
  for (const double spreading : {30.0, 15.0})
    for (const int looks : {1, 2, 4, 8}) {
      CAPTURE(spreading, looks);
      const RecorderSigns signs = recorder_signs(
          LineWithBed(made_line({.looks = looks, .spreading = spreading, .logarithmic = true})));
      CHECK(signs.curve == TransferCurve::logarithmic);
      CHECK(std::abs(signs.looks - looks) <= looks / 4);
      CHECK(signs.curve_range_db == Approx(80.0).epsilon(0.12));
    }
}

TEST_CASE(
    "the level at an angle is that of the bed's angle though the recording begins behind it") {
  RecordedLine line = made_line({.spreading = 40.0, .level = 0.05});
  for (RecordedPing& ping : line.pings) ping.altitude_m = 8.0;
  const RecorderSigns signs = recorder_signs(LineWithBed(line));
  const GrazingLevels whole =
      grazing_levels(LineWithBed(line), Side::port, signs, 0, line.pings.size());
  constexpr std::size_t unrecorded = 120;  // the bed begins at sample 80
  for (std::size_t ping = 0; ping < line.pings.size(); ++ping) {
    line.pings[ping].unrecorded = unrecorded;
    for (std::vector<float>* side : {&line.port, &line.starboard})
      std::fill_n(side->begin() + static_cast<std::ptrdiff_t>(ping * samples), unrecorded, 0.0f);
  }
  const VehiclePath path = vehicle_path(LineWithBed(line));
  CHECK(path.altitude.how == Confidence::stated);
  CHECK(path.altitude_m == std::vector<double>(line.pings.size(), 8.0));
  CHECK(recorder_signs(LineWithBed(line)).column_from.how == Confidence::assumed);
  const GrazingLevels behind =
      grazing_levels(LineWithBed(line), Side::port, signs, 0, line.pings.size());
  std::size_t known = 0;
  for (std::size_t i = 0; i < grazing_cells; ++i)
    if (std::isfinite(behind[i]) && grazing_cell_rad(i) < 38.0 * degree) {
      CAPTURE(i);
      CHECK(behind[i] == Approx(whole[i]).margin(0.3));
      ++known;
    }
  CHECK(known > 12);
}

TEST_CASE("the speckle of a square root is that of roots of Rayleigh amplitudes") {
  std::mt19937 random(2);
  std::exponential_distribution<double> power;
  for (const Detector detector : {Detector::mean, Detector::peak})
    for (const int looks : {1, 2, 4}) {
      double sum = 0.0, squares = 0.0, cubes = 0.0;
      constexpr int draws = 200000;
      for (int i = 0; i < draws; ++i) {
        double amplitude = 0.0;
        for (int look = 0; look < looks; ++look) {
          const double one = std::sqrt(power(random));
          amplitude =
              detector == Detector::peak ? std::max(amplitude, one) : amplitude + one / looks;
        }
        const double value = std::sqrt(amplitude);
        sum += value / draws;
        squares += value * value / draws;
        cubes += value * value * value / draws;
      }
      const double variance = squares - sum * sum;
      const Speckle speckle = speckle_of(detector, looks, TransferCurve::square_root);
      CAPTURE(looks, detector == Detector::peak);
      CHECK(speckle.contrast == Approx(std::sqrt(variance) / sum).epsilon(0.01));
      CHECK(speckle.skew ==
            Approx((cubes - sum * (3.0 * variance + sum * sum)) / std::pow(variance, 1.5))
                .margin(0.08));
    }
}

TEST_CASE("the samples show a square root and its looks, whatever the gain over range") {
  for (const int looks : {1, 2, 4})
    for (const double spreading : {20.0, 30.0}) {
      CAPTURE(looks, spreading);
      const RecorderSigns root = recorder_signs(
          LineWithBed(made_line({.looks = looks, .spreading = spreading, .square_root = true})));
      CHECK(root.curve == TransferCurve::square_root);
      CHECK(root.curve_from.how == Confidence::measured);
      CHECK(root.looks == looks);
      const RecorderSigns line =
          recorder_signs(LineWithBed(made_line({.looks = looks, .spreading = spreading})));
      CHECK(line.curve == TransferCurve::linear);
      CHECK(line.looks == looks);
    }
  // The level of the noise is before the curve.
  const RecordedLine root = made_line({.column = 1e-2, .square_root = true});
  const RecorderSigns signs = recorder_signs(LineWithBed(root));
  CHECK(signs.column_db ==
        Approx(-40.0 + 40.0 * std::log10(32767.0 / signs.full_scale)).margin(1.0));
}

TEST_CASE("a varied altitude shows the gain over range, a constant one does not") {
  const auto slope_db = [](double spreading) {
    const RecordedLine line =
        made_line({.altitude_m = &varied_m, .spreading = spreading, .level = 0.02});
    return range_slope_db(LineWithBed(line), recorder_signs(LineWithBed(line)));
  };
  for (const double spreading : {20.0, 40.0})
    CHECK(slope_db(spreading) == Approx(spreading - 30.0).margin(1.5));
  const RangeLaw law = corrected_law({}, slope_db(43.0), slope_db(30.0), 0.1, range_m);
  CHECK(law.spreading == Approx(43.0).margin(2.0));
  CHECK(law.absorption);
  CHECK(law.from.how == Confidence::fitted);
  // 25 dB less: a recorder without a gain, of which spreading and absorption leave their own slope.
  const RangeLaw none = corrected_law({}, -25.0, 0.0, 0.01, range_m);
  CHECK_FALSE(none.absorption);
  CHECK(none.spreading == Approx(5.0 + std::numbers::ln10 * 0.01 * range_m));
  CHECK_FALSE(none.from.at_limit);
  // No scene has a larger gain than 80.
  const RangeLaw most = corrected_law({}, 60.0, 0.0, 0.01, range_m);
  CHECK(most.spreading == 80.0);
  CHECK(most.from.at_limit);
  const RecordedLine level = made_line({});
  CHECK(std::isnan(range_slope_db(LineWithBed(level), recorder_signs(LineWithBed(level)))));
  // A bed of patches of 40 pings, 12 dB apart.
  RecordedLine patched = made_line({.altitude_m = &varied_m});
  for (const std::size_t patch : {0u, 1u, 4u, 6u})
    for (std::size_t ping = 40 * patch; ping < 40 * patch + 40; ++ping)
      for (auto k = static_cast<std::size_t>(varied_m(ping) / sample_m); k < samples; ++k) {
        patched.port[ping * samples + k] *= 0.25f;
        patched.starboard[ping * samples + k] *= 0.25f;
      }
  CHECK(std::isnan(range_slope_db(LineWithBed(patched), recorder_signs(LineWithBed(patched)))));
  CHECK(corrected_law({}, std::nan(""), 0.0, 0.1, range_m).from.how == Confidence::assumed);
}

TEST_CASE("the level that clipping took from Rayleigh amplitudes is given back") {
  const RecordedLine line = made_line({.level = 0.6});
  const GrazingLevels levels = grazing_levels(
      LineWithBed(line), Side::port, recorder_signs(LineWithBed(line)), 0, line.pings.size());
  CHECK(levels[6] == Approx(20.0 * std::log10(0.6)).margin(0.3));
  CHECK(levels[15] == Approx(20.0 * std::log10(0.6)).margin(0.3));
}
