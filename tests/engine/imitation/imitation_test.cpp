// What an imitation reads off a line without simulating, on lines whose numbers are known.

#include <algorithm>
#include <cmath>
#include <complex>
#include <filesystem>
#include <functional>
#include <numbers>
#include <numeric>
#include <random>

#include "support/catch.h"
#include "support/files.h"
#include "support/small_recording.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/dataset/recipe.h>
#include <ensonify/engine/imitation/imitate.h>
#include <ensonify/engine/imitation/line_fit.h>
#include <ensonify/engine/imitation/pulse_signs.h>
#include <ensonify/engine/output/jsf.h>
#include <ensonify/engine/output/xtf.h>
#include <ensonify/engine/recording/recording_reader.h>
#include <ensonify/engine/recording/some_pings.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/seafloor/material.h>
#include <ensonify/engine/units.h>
#include <ensonify/refine/atomic_file.h>
#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

constexpr std::size_t samples = 500;
constexpr double range_m = 50.0, sample_m = range_m / samples;

/// How a line for a test is made.
struct MadeLine {
  std::size_t pings = 320;
  std::function<double(std::size_t ping)> altitude_m = [](std::size_t) { return 8.0; };
  int looks = 1;
  bool peak = false;
  double spreading = 30.0;  ///< of the gain; 30 makes a bed of this kind even
  double level = 0.1;       ///< rms amplitude over full scale of the bed at 10 m with that gain
  double column = 1e-3;
  double ping_mean = 0.0;
  bool logarithmic = false;  ///< over 80 dB
  bool square_root = false;
  double texture = 0.0;  ///< relative standard deviation of the amplitude
  bool ripples = false;  ///< beyond 15 m, each with a shadow that is longer with range
};

/// A level bed whose echo falls as r^-3, with Rayleigh amplitudes; 15 bits.
RecordedLine made_line(const MadeLine& how) {
  std::mt19937 random(3);
  std::exponential_distribution<double> power;
  std::normal_distribution<double> texture;
  RecordedLine line{.format = "XTF",
                    .frequency_hz = 400e3,
                    .sound_speed_mps = 1500.0,
                    .peak_detector = how.peak,
                    .samples = samples};
  for (std::size_t ping = 0; ping < how.pings; ++ping) {
    line.pings.push_back(
        {.number = ping,
         .t_s = 1e9 + 0.1 * static_cast<double>(ping),
         .place = GeographicPlace{55.0 * degree + 3e-8 * static_cast<double>(ping), 10.0 * degree},
         .depth_m = 20.0 - how.altitude_m(ping),
         .range_m = range_m,
         .samples = samples});
    for (std::vector<float>* side : {&line.port, &line.starboard}) {
      std::vector<double> row(samples);
      double mean = 0.0;
      for (std::size_t k = 0; k < samples; ++k) {
        const double r = (static_cast<double>(k) + 0.5) * sample_m;
        const bool water = r < how.altitude_m(ping);
        double rms =
            water ? how.column : how.level * std::pow(r / 10.0, (how.spreading - 30.0) / 20.0);
        constexpr double first_m = 15.0, period_m = 1.5;
        const double shadow = std::min(0.7, (r - first_m) / 50.0);  // as a share of the period
        if (how.ripples && r > first_m && std::fmod(r, period_m) < shadow * period_m)
          rms = how.column;
        if (how.texture > 0.0 && !water) rms *= std::max(0.0, 1.0 + how.texture * texture(random));
        double amplitude = 0.0;
        for (int look = 0; look < how.looks; ++look) {
          const double one = rms * std::sqrt(power(random));
          amplitude = how.peak ? std::max(amplitude, one) : amplitude + one / how.looks;
        }
        row[k] = amplitude;
        mean += amplitude / samples;
      }
      for (double amplitude : row) {
        if (how.ping_mean > 0.0) amplitude *= how.ping_mean / mean;
        if (how.logarithmic) amplitude = 1.0 + 20.0 * std::log10(std::max(amplitude, 1e-4)) / 80.0;
        if (how.square_root) amplitude = std::sqrt(amplitude);
        side->push_back(static_cast<float>(std::lround(32767.0 * std::clamp(amplitude, 0.0, 1.0))));
      }
    }
  }
  return line;
}

/// 4 to 12 m and back.
double varied_m(std::size_t ping) {
  return 8.0 + 4.0 * std::sin(2.0 * std::numbers::pi * static_cast<double>(ping) / 320.0);
}

}  // namespace

TEST_CASE("the bottom line and the navigation give the vehicle's path") {
  RecordedLine line = made_line({.altitude_m = &varied_m});
  // Something hangs in the water on one side, and some pings have no place.
  for (std::size_t ping = 100; ping < 130; ++ping) {
    line.pings[ping].place.reset();
    for (std::size_t k = 20; k < 40; ++k) line.port[ping * samples + k] = 20000.0f;
  }
  const VehiclePath path = vehicle_path(line);
  REQUIRE(path.altitude_m.size() == 320);
  for (std::size_t ping = 0; ping < 320; ++ping) {
    CAPTURE(ping);
    CHECK(std::abs(path.altitude_m[ping] - varied_m(ping)) < 0.5);
  }
  CHECK(path.bed_depth_m == Approx(20.0).margin(0.1));
  CHECK(path.depth.how == Confidence::stated);
  CHECK(path.ping_interval_s == Approx(0.1).epsilon(1e-3));
  for (const double interval_s : {0.01477, 0.0151, 0.02685, 0.034}) {
    RecordedLine rounded = line;  // as an XTF has times, with a pause
    for (std::size_t ping = 0; ping < rounded.pings.size(); ++ping)
      rounded.pings[ping].t_s =
          std::floor(100.0 * interval_s * double(ping) + (ping < 200 ? 0.0 : 3000.0)) / 100.0;
    CHECK(vehicle_path(rounded).ping_interval_s == Approx(interval_s).epsilon(0.01));
  }
  // 3e-8 rad of latitude at 55 degrees: the meridian's radius of curvature is 6378 km (WGS 84).
  CHECK(path.speed_mps == Approx(10.0 * 3e-8 * 6378.2e3).epsilon(2e-3));
  CHECK(path.origin.value().latitude_rad ==
        Approx(55.0 * degree + 3e-8 * 159.5).epsilon(0).margin(1e-9));
  CHECK(path.roll_rad.empty());
  CHECK(path.attitude.how == Confidence::assumed);

  for (RecordedPing& ping : line.pings) {
    ping.place.reset();
    ping.t_s.reset();
    ping.depth_m.reset();
    ping.pitch_rad = 20.0 * degree * (ping.number % 2 == 0 ? 1.0 : 0.9999);
  }
  const VehiclePath bare = vehicle_path(line);
  CHECK(bare.place.how == Confidence::assumed);
  CHECK(bare.time.how == Confidence::assumed);
  CHECK(bare.depth.how == Confidence::assumed);
  CHECK(bare.ping_interval_s == Approx(2.0 * range_m / 1500.0));
  CHECK_FALSE(bare.origin);
  // A pitched sonar's first return comes from ahead.
  CHECK(bare.altitude_m[10] == Approx(path.altitude_m[10] * std::cos(20.0 * degree)).epsilon(1e-3));
}

TEST_CASE("an altitude that changes fast at the ends of a line is followed to the ends") {
  const auto altitude_m = [](std::size_t ping) {
    const auto from_end = static_cast<double>(std::min<std::size_t>(ping, 319 - ping));
    return 4.0 + std::max(0.0, 4.0 - 0.13 * from_end);
  };
  const VehiclePath path = vehicle_path(made_line({.altitude_m = altitude_m}));
  for (std::size_t ping = 0; ping < 320; ++ping) {
    CAPTURE(ping);
    CHECK(std::abs(path.altitude_m[ping] - altitude_m(ping)) < 0.4);
  }
}

TEST_CASE("wrong fixes neither turn nor move a path") {
  const RecordedLine line = made_line({});
  const VehiclePath whole = vehicle_path(line);
  // One at the begin, and more in one place than a median over the pings around can leave out. The
  // last is on the other side of the Earth.
  RecordedLine wrong = line;
  wrong.pings[0].place = GeographicPlace{1.0 * degree, 1.0 * degree};
  for (std::size_t ping = 100; ping < 140; ++ping)
    wrong.pings[ping].place = GeographicPlace{55.0 * degree, -10.0 * degree};
  wrong.pings[319].place = GeographicPlace{-20.0 * degree, -170.0 * degree};
  const VehiclePath path = vehicle_path(wrong);
  CHECK(path.origin.value().latitude_rad ==
        Approx(whole.origin.value().latitude_rad).epsilon(0).margin(1e-7));
  CHECK(path.origin.value().longitude_rad ==
        Approx(whole.origin.value().longitude_rad).epsilon(0).margin(1e-7));
  for (std::size_t ping = 0; ping < 320; ++ping) {
    CAPTURE(ping);
    CHECK(std::hypot(path.x_m[ping] - whole.x_m[ping], path.y_m[ping] - whole.y_m[ping]) < 0.5);
  }
}

TEST_CASE("a range that no sonar has is named") {
  RecordedLine line = made_line({});
  for (RecordedPing& ping : line.pings) ping.range_m = 1e9;
  const tests::TemporaryFolder folder;
  try {
    imitate(line, folder.path(), {});
    FAIL("no error");
  } catch (const RecordingError& error) {
    CHECK(std::string(error.what()).starts_with("the pings state a range of 1e+09 m"));
  }
}

TEST_CASE("pings of the most frequent range are imitated, however long the others are") {
  const auto outcome = [](std::size_t pings, std::size_t others) {
    RecordedLine line = made_line({.pings = pings});
    set_samples(line, 2 * samples);
    for (std::size_t i = 0; i < others; ++i) {
      RecordedPing ping = line.pings.back();
      ping.number = pings + i;
      ping.range_m = (2.0 + 0.1 * static_cast<double>(i)) * range_m;
      ping.samples = 2 * samples;
      line.pings.push_back(ping);
      line.port.resize(line.pings.size() * line.samples, 100.0f);
      line.starboard.resize(line.pings.size() * line.samples, 100.0f);
    }
    const tests::TemporaryFolder folder;
    try {
      imitate(line, folder.path(), {.progress = [](auto, auto, auto) { return false; }});
    } catch (const Stopped&) {
      return std::string("begins");
    } catch (const RecordingError& error) {
      return std::string(error.what());
    }
    return std::string("ends");
  };
  CHECK(outcome(200, 60) == "begins");
  CHECK(outcome(1, 60) ==
        "the recording has 1 ping of one range and length, and an imitation needs 64");
  CHECK(outcome(63, 60) ==
        "the recording has 63 pings of one range and length, and an imitation needs 64");
}

TEST_CASE("a roll or a pitch that no sonar has is unknown") {
  RecordedLine line = made_line({});
  for (RecordedPing& ping : line.pings) {
    ping.roll_rad = 3.0 * degree;
    ping.pitch_rad = -2.0 * degree;
  }
  line.pings[50].pitch_rad = 150.0 * degree;
  line.pings[60].roll_rad = -170.0 * degree;
  const VehiclePath path = vehicle_path(line);
  CHECK(path.pitch_rad == std::vector<double>(320, -2.0 * degree));
  CHECK(path.roll_rad == std::vector<double>(320, 3.0 * degree));
}

TEST_CASE("a line without a bottom line is refused") {
  RecordedLine line = made_line({});
  std::ranges::fill(line.port, 100.0f);
  std::ranges::fill(line.starboard, 100.0f);
  CHECK_THROWS_AS(vehicle_path(line), RecordingError);
}

TEST_CASE("an oscillation has the rms and the period that were put in, whatever the turns") {
  std::vector<double> values;
  for (int i = 0; i < 3000; ++i) {
    const double t = 0.1 * i;
    values.push_back(3.0 + 0.01 * t + 0.5 * std::sin(2.0 * std::numbers::pi * t / 4.0) +
                     2.0 * std::sin(2.0 * std::numbers::pi * t / 100.0) + (i < 1500 ? 0.0 : 3.0));
  }
  const Oscillation found = oscillation_of(0.1, values);
  CHECK(found.rms == Approx(0.5 / std::numbers::sqrt2).epsilon(0.15));
  CHECK(found.period_s == Approx(4.0).epsilon(0.05));
}

TEST_CASE("the contrast of speckle is that of Rayleigh amplitudes") {
  CHECK(speckle_of(Detector::mean, 1).contrast == Approx(0.52272).epsilon(1e-4));
  CHECK(speckle_of(Detector::mean, 4).contrast == Approx(0.26136).epsilon(1e-4));
  CHECK(speckle_of(Detector::peak, 1).contrast == Approx(0.52272).epsilon(1e-3));
  // By chance: the largest of three, from many draws.
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
    const RecorderSigns signs = recorder_signs(made_line({.looks = looks}));
    CHECK(signs.looks == looks);
    CHECK(signs.detector == Detector::mean);
    CHECK(signs.curve == TransferCurve::linear);
    CHECK(signs.bits <= 15);
    CHECK_FALSE(signs.clips);
    if (looks == 1)
      CHECK(signs.column_db ==
            Approx(-60.0 + 20.0 * std::log10(32767.0 / signs.full_scale)).margin(1.0));
  }
  // Texture adds to the contrast, which then lies nearer to that of 2 looks.
  CHECK(recorder_signs(made_line({.looks = 3, .texture = 0.16})).looks == 3);
  const RecorderSigns peak = recorder_signs(made_line({.looks = 3, .peak = true}));
  CHECK(peak.detector == Detector::peak);
  CHECK(peak.looks == 3);
  // The altitude changes the share of water, and with it the mean, unless each ping is scaled.
  const RecorderSigns scaled =
      recorder_signs(made_line({.altitude_m = &varied_m, .ping_mean = 0.25}));
  CHECK(scaled.ping_mean == Approx(0.25).epsilon(0.03));  // without the first 2 % of the samples
  CHECK(scaled.clips);
  CHECK(scaled.bits == 15);
  CHECK(recorder_signs(made_line({.altitude_m = &varied_m})).ping_mean == 0.0);
  // On an even bed at a constant altitude the means are alike without any scale.
  CHECK(recorder_signs(made_line({.looks = 8})).ping_mean == 0.0);
  const RecorderSigns noiseless = recorder_signs(made_line({.column = 0.0}));
  CHECK(noiseless.column_from.how == Confidence::assumed);
  CHECK(noiseless.column_db < scatter::amplitude_to_db(0.5 / 32767.0));
  // A recorder without a logarithm, whose spread hardly grows with the mean.
  const RecorderSigns rippled = recorder_signs(made_line({.looks = 4, .ripples = true}));
  CHECK(rippled.curve == TransferCurve::linear);
  CHECK(rippled.looks == 4);
  const RecorderSigns logarithmic =
      recorder_signs(made_line({.spreading = 15.0, .logarithmic = true}));
  CHECK(logarithmic.curve == TransferCurve::logarithmic);
  CHECK(logarithmic.curve_range_db == Approx(80.0).epsilon(0.15));
}

TEST_CASE("the skew of decibels shows the looks of a logarithmic recorder, and they its range") {
  // By chance, and by the Gumbel distribution for one look.
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
  // With the level of the bed steady over range, or not.
  for (const double spreading : {30.0, 15.0})
    for (const int looks : {1, 2, 4, 8}) {
      CAPTURE(spreading, looks);
      const RecorderSigns signs =
          recorder_signs(made_line({.looks = looks, .spreading = spreading, .logarithmic = true}));
      CHECK(signs.curve == TransferCurve::logarithmic);
      CHECK(std::abs(signs.looks - looks) <= looks / 4);
      CHECK(signs.curve_range_db == Approx(80.0).epsilon(0.12));
    }
}

TEST_CASE(
    "the level at an angle is that of the bed's angle though the recording begins behind it") {
  RecordedLine line = made_line({.spreading = 40.0, .level = 0.05});
  for (RecordedPing& ping : line.pings) ping.altitude_m = 8.0;
  const RecorderSigns signs = recorder_signs(line);
  const GrazingLevels whole = grazing_levels(line, Side::port, signs, 0, line.pings.size());
  constexpr std::size_t unrecorded = 120;  // the bed begins at sample 80
  for (std::size_t ping = 0; ping < line.pings.size(); ++ping) {
    line.pings[ping].unrecorded = unrecorded;
    for (std::vector<float>* side : {&line.port, &line.starboard})
      std::fill_n(side->begin() + static_cast<std::ptrdiff_t>(ping * samples), unrecorded, 0.0f);
  }
  const VehiclePath path = vehicle_path(line);
  CHECK(path.altitude.how == Confidence::stated);
  CHECK(path.altitude_m == std::vector<double>(line.pings.size(), 8.0));
  CHECK(recorder_signs(line).column_from.how == Confidence::assumed);
  const GrazingLevels behind = grazing_levels(line, Side::port, signs, 0, line.pings.size());
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
      const RecorderSigns root =
          recorder_signs(made_line({.looks = looks, .spreading = spreading, .square_root = true}));
      CHECK(root.curve == TransferCurve::square_root);
      CHECK(root.curve_from.how == Confidence::measured);
      CHECK(root.looks == looks);
      const RecorderSigns line =
          recorder_signs(made_line({.looks = looks, .spreading = spreading}));
      CHECK(line.curve == TransferCurve::linear);
      CHECK(line.looks == looks);
    }
  // The level of the noise is before the curve.
  const RecordedLine root = made_line({.column = 1e-2, .square_root = true});
  const RecorderSigns signs = recorder_signs(root);
  CHECK(signs.column_db ==
        Approx(-40.0 + 40.0 * std::log10(32767.0 / signs.full_scale)).margin(1.0));
}

TEST_CASE("a varied altitude shows the gain over range, a constant one does not") {
  const auto slope_db = [](double spreading) {
    const RecordedLine line =
        made_line({.altitude_m = &varied_m, .spreading = spreading, .level = 0.02});
    return range_slope_db(line, recorder_signs(line));
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
  const RecordedLine level = made_line({});
  CHECK(std::isnan(range_slope_db(level, recorder_signs(level))));
  // A bed of patches of 40 pings, 12 dB apart.
  RecordedLine patched = made_line({.altitude_m = &varied_m});
  for (const std::size_t patch : {0u, 1u, 4u, 6u})
    for (std::size_t ping = 40 * patch; ping < 40 * patch + 40; ++ping)
      for (auto k = static_cast<std::size_t>(varied_m(ping) / sample_m); k < samples; ++k) {
        patched.port[ping * samples + k] *= 0.25f;
        patched.starboard[ping * samples + k] *= 0.25f;
      }
  CHECK(std::isnan(range_slope_db(patched, recorder_signs(patched))));
  CHECK(corrected_law({}, std::nan(""), 0.0, 0.1, range_m).from.how == Confidence::assumed);
}

TEST_CASE("the level that clipping took from Rayleigh amplitudes is given back") {
  const RecordedLine line = made_line({.level = 0.6});
  const GrazingLevels levels =
      grazing_levels(line, Side::port, recorder_signs(line), 0, line.pings.size());
  CHECK(levels[6] == Approx(20.0 * std::log10(0.6)).margin(0.3));
  CHECK(levels[15] == Approx(20.0 * std::log10(0.6)).margin(0.3));
}

TEST_CASE("the correlation of amplitudes is that of simulated Rayleigh amplitudes") {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (const double rho : {0.3, 0.7, 0.95}) {
    double sum_a = 0.0, sum_b = 0.0, sum_aa = 0.0, sum_bb = 0.0, sum_ab = 0.0;
    constexpr int pairs = 200000;
    for (int i = 0; i < pairs; ++i) {
      // Braces: the real part is drawn first.
      const std::complex<double> one{normal(random), normal(random)};
      const std::complex<double> other{normal(random), normal(random)};
      const double a = std::abs(one), b = std::abs(rho * one + std::sqrt(1.0 - rho * rho) * other);
      sum_a += a;
      sum_b += b;
      sum_aa += a * a;
      sum_bb += b * b;
      sum_ab += a * b;
    }
    const auto covariance = [&](double ab, double a, double b) {
      return ab / pairs - a * b / pairs / pairs;
    };
    const double simulated =
        covariance(sum_ab, sum_a, sum_b) /
        std::sqrt(covariance(sum_aa, sum_a, sum_a) * covariance(sum_bb, sum_b, sum_b));
    CHECK(amplitude_correlation(rho) == Approx(simulated).margin(0.01));
  }
  CHECK(amplitude_correlation(0.0) == 0.0);
  CHECK(amplitude_correlation(1.0) == Approx(1.0).margin(1e-3));
}

TEST_CASE("the correlations over one and two samples show the pulse and its bandwidth") {
  const Pulse cw{.bandwidth_hz = 1.0};
  const Pulse sweep{.kind = PulseKind::lfm, .bandwidth_hz = 1.0};
  const Pulse hann{.kind = PulseKind::lfm, .bandwidth_hz = 1.0, .window = PulseWindow::hann};
  for (const auto& of : {std::pair{cw, 0.3}, {sweep, 0.4}, {hann, 0.8}}) {
    const Pulse& pulse = of.first;
    const double apart = of.second;
    const auto correlation = [&](double times) {
      return amplitude_correlation(pulse.correlation(times * apart));
    };
    CAPTURE(apart);
    CHECK(time_times_bandwidth(pulse, correlation(1.0)) == Approx(apart));
    const Pulse found = likely_pulse(correlation(1.0), correlation(2.0));
    CHECK(found.kind == pulse.kind);
    CHECK(found.window == pulse.window);
  }
  // Short pulses cannot be distinguished.
  CHECK(likely_pulse(0.05, 0.01).kind == PulseKind::cw);
  // A sweep that could have either window has one, as that of most recorders.
  const double one = amplitude_correlation(sweep.correlation(0.5)),
               two = amplitude_correlation(sweep.correlation(1.0));
  CHECK(likely_pulse(one, two).window == PulseWindow::hann);
}

TEST_CASE("the correlation over a sample shows the window of a sweep of known bandwidth") {
  for (const double apart : {0.3, 0.6, 1.0, 1.3})
    for (const PulseWindow window : {PulseWindow::none, PulseWindow::hann}) {
      CAPTURE(apart, window == PulseWindow::hann);
      const Pulse sweep{.kind = PulseKind::lfm, .bandwidth_hz = 1.0, .window = window};
      const double correlation = amplitude_correlation(sweep.correlation(apart));
      for (const double error : {-0.03, 0.03})
        CHECK(likely_window(apart, correlation + error) == window);
    }
  CHECK(likely_window(3.0, 0.0) == PulseWindow::hann);
}

TEST_CASE("pauses and set clocks change neither the ping interval nor the speed") {
  const RecordedLine line = made_line({});
  const auto with_times = [&](auto&& time_of) {
    RecordedLine other = line;
    for (std::size_t ping = 0; ping < other.pings.size(); ++ping)
      other.pings[ping].t_s = 1e9 + time_of(ping);
    return vehicle_path(other);
  };
  const double speed_mps = vehicle_path(line).speed_mps;
  REQUIRE(speed_mps > 1.0);
  for (const double jump_s : {3600.0, -3600.0, -20.0, -0.5}) {
    CAPTURE(jump_s);
    const VehiclePath path = with_times(
        [&](std::size_t ping) { return 0.1 * double(ping) + (ping < 150 ? 0.0 : jump_s); });
    CHECK(path.ping_interval_s == Approx(0.1));
    CHECK(path.speed_mps == Approx(speed_mps).epsilon(0.02));
    CHECK(path.time.how == (jump_s > 0.0 ? Confidence::stated : Confidence::measured));
    CHECK(std::ranges::is_sorted(path.t_s));
  }
  // Neighbours in the wrong order, and whole seconds.
  CHECK(with_times([](std::size_t ping) { return 0.1 * double(ping ^ 1u); }).ping_interval_s ==
        Approx(0.1).epsilon(0.01));
  CHECK(with_times([](std::size_t ping) {
          return std::floor(0.1 * double(ping));
        }).ping_interval_s == Approx(0.1).epsilon(0.04));
  const VehiclePath still = with_times([](std::size_t) { return 5.0; });
  CHECK(still.time.how == Confidence::assumed);
  CHECK(still.ping_interval_s == Approx(2.0 * range_m / 1500.0));
}

TEST_CASE("the sediment whose backscatter explains the level over the angle is the nearest") {
  LineModel model;
  model.material = "medium sand";
  const auto strength_db = [&](const char* name, double grazing_rad) {
    return 10.0 * std::log10(backscatter_of(material_named(name, {}), model.frequency_hz,
                                            model.sound_speed_mps, 0.0)
                                 ->cross_section(grazing_rad));
  };
  for (const char* name : {"rough rock", "sandy gravel", "clay"}) {
    GrazingLevels excess_db;
    for (std::size_t i = 0; i < grazing_cells; ++i) {
      const double angle = (static_cast<double>(i) + 0.5) * grazing_cell_deg * degree;
      excess_db[i] = strength_db(name, angle) - strength_db("medium sand", angle) + 7.0;
    }
    const std::vector<NearSediment> sediments = nearest_sediments(model, excess_db, true);
    CAPTURE(name, sediments.front().name);
    CHECK(sediments.front().rms_db < 1e-6);
    CHECK(std::ranges::any_of(
        sediments, [&](const NearSediment& one) { return one.name == name && one.rms_db < 1e-6; }));
    // It would return more energy than arrives.
    CHECK(std::ranges::none_of(
        sediments, [](const NearSediment& one) { return one.name == "handbook rough rock"; }));
  }
  GrazingLevels none;
  none.fill(std::nan(""));
  CHECK(nearest_sediments(model, none, true).empty());
}

TEST_CASE("an error of the bottom line does not change the sediment that a narrow beam shows") {
  LineModel model;
  model.samples = 500;
  model.range_m = 40.0;
  model.path.altitude_m.assign(224, 7.0);
  const auto strength_db = [&](const char* name, double grazing_rad) {
    return 10.0 * std::log10(backscatter_of(material_named(name, {}), model.frequency_hz,
                                            model.sound_speed_mps, 0.0)
                                 ->cross_section(grazing_rad));
  };
  // A beam of 50 degrees at 20 degrees of depression: 12 dB two ways over half its width.
  const auto beam_db = [](double grazing_rad) {
    return -6.0 * std::pow((grazing_rad / degree - 20.0) / 25.0, 2);
  };
  for (const double bins : {-0.7, 0.0, 0.7}) {
    GrazingLevels excess_db;
    for (std::size_t i = 0; i < grazing_cells; ++i) {
      const double angle = grazing_cell_rad(i);
      // A range is altitude / sin(angle), so another altitude gives a range another angle.
      const double other = std::asin(std::min(1.0, std::sin(angle) * (1.0 + bins * 0.08 / 7.0)));
      for (const std::size_t side : {0u, 1u})
        model.levels_db[side][i] = beam_db(angle) + strength_db("fine sand", angle) + 10.0;
      excess_db[i] = strength_db("fine sand", angle) - strength_db("medium sand", angle) +
                     beam_db(other) - beam_db(angle);
    }
    const std::vector<NearSediment> sediments = nearest_sediments(model, excess_db, true);
    CAPTURE(bins, sediments.front().name);
    CHECK(sediments.front().name == "fine sand");
    // Silts have nearly one backscatter, sands have not.
    CHECK(as_near_as_the_first(sediments) < 6);
  }
  GrazingLevels excess_db;
  for (std::size_t i = 0; i < grazing_cells; ++i)
    excess_db[i] =
        strength_db("silt", grazing_cell_rad(i)) - strength_db("medium sand", grazing_cell_rad(i));
  CHECK(as_near_as_the_first(nearest_sediments(model, excess_db, true)) > 5);
}

TEST_CASE("a darker part of the bed is on the map of tones where it is") {
  RecordedLine line = made_line({.pings = 800});
  VehiclePath path = vehicle_path(line);
  for (std::size_t i = 0; i < 800; ++i) path.y_m[i] = 0.1 * (static_cast<double>(i) - 400.0);
  CHECK(tone_map(line, path, recorder_signs(line), 0.0, 104.0, 184.0).steps.empty());
  // 12 dB darker to starboard in the northern half: the line goes north.
  for (std::size_t ping = 400; ping < 800; ++ping)
    for (std::size_t k = 90; k < samples; ++k) line.starboard[ping * samples + k] *= 0.25f;
  const ToneMap map = tone_map(line, path, recorder_signs(line), 0.0, 104.0, 184.0);
  REQUIRE(map.steps.size() == map.columns * map.rows);
  // Over 21 x 21 pixels, because what lies between two steps gets either of them.
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
  RecorderSigns root = recorder_signs(line);
  root.curve = TransferCurve::square_root;
  root.full_scale = 32767.0;
  for (std::vector<float>* side : {&line.port, &line.starboard})
    for (float& sample : *side) sample = std::sqrt(32767.0f * sample);
  const ToneMap of_root = tone_map(line, path, root, 0.0, 104.0, 184.0);
  REQUIRE(of_root.steps.size() == map.steps.size());
  check(of_root);
}

TEST_CASE("a tone that changes slowly has no borders") {
  RecordedLine line = made_line({.pings = 800});
  VehiclePath path = vehicle_path(line);
  for (std::size_t i = 0; i < 800; ++i) path.y_m[i] = 0.1 * (static_cast<double>(i) - 400.0);
  // To starboard from -6 to 6 dB along the line.
  for (std::size_t ping = 0; ping < 800; ++ping)
    for (std::size_t k = 90; k < samples; ++k)
      line.starboard[ping * samples + k] *=
          static_cast<float>(std::pow(10.0, (0.015 * static_cast<double>(ping) - 6.0) / 20.0));
  const ToneMap map = tone_map(line, path, recorder_signs(line), 0.0, 104.0, 184.0);
  REQUIRE(map.steps.size() == map.columns * map.rows);
  // By rows of pixels over 20 m from east to west, the mean follows the change.
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
  VehiclePath path = vehicle_path(line);
  for (std::size_t i = 0; i < 800; ++i) path.y_m[i] = 0.1 * (static_cast<double>(i) - 400.0);
  const RecorderSigns recorder = recorder_signs(line);
  const double slope_db = range_slope_db(line, recorder);
  CHECK(slope_db == Approx(20.0).margin(1.0));
  CHECK(tone_map(line, path, recorder, slope_db, 104.0, 184.0).steps.empty());
  CHECK_FALSE(tone_map(line, path, recorder, 0.0, 104.0, 184.0).steps.empty());
}

TEST_CASE("a model's scene and recipe are read without a fault, and each key has its evidence") {
  const tests::TemporaryFolder folder;
  const RecordedLine line = made_line({.altitude_m = &varied_m});
  LineModel model;
  model.path = vehicle_path(line);
  model.recorder = recorder_signs(line);
  model.range_m = range_m;
  model.samples = samples;
  model.bed = bed_extent(model);
  model.tones = {105, 166, std::vector<std::int8_t>(std::size_t{105} * 166, 0)};
  model.tones.steps[3] = -2;
  model.tones.steps[7000] = 1;
  model.gain_db = -100.0;
  refine::write_file(folder / "tones.png", tones_png(model));
  for (std::vector<double>& side : model.vertical_db)
    for (std::size_t i = 0; i < grazing_cells; ++i) side.push_back(-0.5 * static_cast<double>(i));
  tests::write_text(folder / "navigation.csv", navigation_csv(model));
  tests::write_text(folder / "beam.csv", beam_csv(model));
  const Scene scene =
      parse_scene(scene_text(model), "scene.toml", {}, ScenePaths{folder.path(), {}});
  CHECK(scene.sonars.front().bins == 500);
  CHECK(scene.sonars.front().range_m == range_m);
  // One way, and 0 dB at its peak.
  CHECK(beam_csv(model).find("\n1,0.000,0.000\n") != std::string::npos);
  CHECK(beam_csv(model).find("\n9,-1.000,-1.000\n") != std::string::npos);
  CHECK(scene.track.kind == TrackKind::file);
  REQUIRE(scene.seafloor.seabed.patches.size() == 2);
  // The brightest has the sediment's strength, and the bed less; the gain makes up for it.
  CHECK(scene.sonars.front().receiver.gain_db == -98.0);
  REQUIRE(scene.materials.size() == 3);
  CHECK(scene.materials[0].strength_offset_db == -2.0);
  CHECK(scene.materials[1].strength_offset_db == -6.0);
  CHECK(scene.materials[2].strength_offset_db == 0.0);
  for (const FoundKey& key : found_keys(model)) CHECK_FALSE(key.name().empty());
  CHECK(scene.seafloor.depth_m == Approx(20.0).margin(0.1));

  tests::write_text(folder / "recipe.toml", recipe_text(model));
  const Recipe recipe(folder / "recipe.toml", folder.path());  // as --data
  for (const std::size_t i : {0u, 1u, 63u}) {
    const Scene sample = recipe.sample(i).scene;
    CHECK(sample.track.altitude_m >= 4.0);
    CHECK(sample.track.altitude_m <= 12.5);
    CHECK(sample.seafloor.depth_m > sample.track.altitude_m);
  }
}

TEST_CASE("rows of several beams are known by their beam or by their time") {
  RecordedLine line = made_line({});
  CHECK_FALSE(has_several_beams(line));
  for (RecordedPing& ping : line.pings) ping.t_s = 1e9 + 0.1 * static_cast<double>(ping.number / 2);
  CHECK(has_several_beams(line));
  // A clock of whole seconds.
  for (RecordedPing& ping : line.pings) ping.t_s = 1e9 + static_cast<double>(ping.number / 10);
  CHECK_FALSE(has_several_beams(line));
  line.pings[3].beam = 1;
  CHECK(has_several_beams(line));
}

namespace {

/// A quiet sonar over a level bed.
Scene level_scene(const std::vector<std::string>& overrides) {
  return parse_scene(R"(
version = 1
[seafloor]
extent_east_m = 70
extent_north_m = 40
cell_m = 0.5
depth_m = 14
fractal.height_at_1m_m = 0
[track]
pings = 96
ping_interval_s = 0.1
altitude_m = 8
[sonar.sidescan]
range_m = 30
vertical_beamwidth_deg = 60
tilt_deg = 30
planes = 2
noise = false
output_noise_db = -60
[output]
exr = false
)",
                     "scene.toml", overrides);
}

/// A recording of the level scene with 300 samples per side.
RecordedLine level_line(const tests::TemporaryFolder& folder) {
  run(level_scene({"sonar.sidescan.bins=300", "sonar.sidescan.bandwidth_hz=20e3",
                   "sonar.sidescan.elevations=500", "output.xtf=true"}),
      folder / "run", {});
  return read_recording(folder / "run/sidescan.xtf").at(0);
}

}  // namespace

TEST_CASE("a weaker side stays weaker, and a silent one is left out and named") {
  const tests::TemporaryFolder folder;
  RecordedLine line = level_line(folder);
  const auto mean = [](const std::vector<float>& side) {
    return std::accumulate(side.begin(), side.end(), 0.0) / static_cast<double>(side.size());
  };
  for (const char* name : {"weaker", "silent", "missing"})
    std::filesystem::create_directory(folder / name);
  for (float& sample : line.port) sample *= 0.25f;
  const Imitation weaker = imitate(line, folder / "weaker", {});
  CHECK(mean(weaker.imitated.port) / mean(weaker.imitated.starboard) ==
        Approx(mean(line.port) / mean(line.starboard)).epsilon(0.15));
  const auto names_port = [](const Imitation& made) {
    return std::ranges::any_of(
        made.unknown, [](const std::string& one) { return one.starts_with("the port side: "); });
  };
  CHECK_FALSE(names_port(weaker));
  std::ranges::fill(line.port, 0.0f);
  const Imitation silent = imitate(line, folder / "silent", {});
  CHECK(silent.imitated.port.empty());
  CHECK(names_port(silent));
  line.port.clear();  // as a reader leaves it out
  const Imitation missing = imitate(line, folder / "missing", {});
  CHECK(missing.imitated.port.empty());
  CHECK(names_port(missing));
}

TEST_CASE("an imitation has the recording's numbers, and begins where the recording does") {
  const tests::TemporaryFolder folder;
  RecordedLine line = level_line(folder);
  constexpr std::size_t unrecorded = 20;
  for (std::vector<float>* side : {&line.port, &line.starboard})
    for (std::size_t i = 0; i < side->size(); ++i)
      (*side)[i] = i % line.samples < unrecorded ? 0.0f : 1.234e-7f * (*side)[i];
  for (RecordedPing& ping : line.pings) ping.unrecorded = unrecorded;
  std::filesystem::create_directory(folder / "imitation");
  const Imitation made = imitate(line, folder / "imitation", {});
  const auto mean = [](const std::vector<float>& side) {
    return std::accumulate(side.begin(), side.end(), 0.0) / static_cast<double>(side.size());
  };
  CHECK(mean(made.imitated.port) == Approx(mean(line.port)).epsilon(0.1));
  for (std::size_t ping = 0; ping < made.imitated.pings.size(); ++ping) {
    CHECK(made.imitated.pings[ping].unrecorded == unrecorded);
    const auto begin = made.imitated.row(Side::port, ping).first(unrecorded);
    CHECK(std::ranges::count(begin, 0.0f) == std::ssize(begin));
  }
  CHECK(std::ranges::any_of(made.unknown, [](const std::string& one) {
    return one.starts_with("the first 2.00 m of range: the recording begins there");
  }));
  // Nothing to doubt about the bottom line, until the water column is cut off.
  const auto doubts = [](const Imitation& imitation) {
    return std::ranges::any_of(imitation.unknown, [](const std::string& one) {
      return one.starts_with("whether the bottom line is right");
    });
  };
  CHECK_FALSE(doubts(made));
  for (std::size_t ping = 0; ping < line.pings.size(); ++ping) {
    line.pings[ping].unrecorded = 0;
    for (std::vector<float>* side : {&line.port, &line.starboard}) {
      const auto row = side->begin() + static_cast<std::ptrdiff_t>(ping * line.samples);
      std::rotate(row, row + 81, row + static_cast<std::ptrdiff_t>(line.samples));
    }
  }
  std::filesystem::create_directory(folder / "cut");
  CHECK(doubts(imitate(line, folder / "cut", {})));
}

TEST_CASE("a sweep whose bandwidth a file states gets its window, and the bed its level") {
  for (const PulseWindow window : {PulseWindow::none, PulseWindow::hann}) {
    const bool hann = window == PulseWindow::hann;
    CAPTURE(hann);
    const tests::TemporaryFolder folder;
    std::filesystem::create_directory(folder / "imitation");
    run(level_scene({"sonar.sidescan.bins=600", "sonar.sidescan.pulse=lfm",
                     "sonar.sidescan.pulse_length_s=2e-3", "sonar.sidescan.bandwidth_hz=15e3",
                     "sonar.sidescan.elevations=1000", "output.jsf=true",
                     hann ? "sonar.sidescan.window=hann" : "sonar.sidescan.window=none"}),
        folder / "run", {});
    const RecordedLine line = read_recording(folder / "run/sidescan.jsf").at(0);
    const Imitation made = imitate(line, folder / "imitation", {});
    CHECK(made.model.pulse.kind == PulseKind::lfm);
    CHECK(made.model.pulse.window == window);
    // A JSF does not state the beam. The altitude is the run's all the same, within a bin.
    CHECK(std::abs(made.model.path.bed_depth_m + made.model.altitude_shift_m - 14.0) < 0.07);
    std::size_t levels = 0;
    for (const ComparedStatistic& one : made.statistics)
      // Steeper levels are of few samples.
      if (one.name.starts_with("level_at_") && one.name.ends_with("_deg_db") &&
          std::stoi(one.name.substr(9)) < 60 && std::isfinite(one.a)) {
        CAPTURE(one.name);
        CHECK(one.b == Approx(one.a).margin(2.0));
        ++levels;
      }
    CHECK(levels > 6);
  }
}

TEST_CASE("sixty damaged recordings are refused, or read with what is whole in them") {
  Recording written = tests::small_recording(64);
  const NavPing first = written.pings.front();
  written.pings.clear();
  written.samples.clear();
  written.gain_db.resize(80);
  for (std::size_t row = 0; row < 80; ++row) {
    NavPing& ping = written.pings.emplace_back(first);
    ping.row = row;
    ping.number = row;
    ping.unix_ms += static_cast<std::int64_t>(250 * row);
    for (std::size_t i = 0; i < 128; ++i)
      written.samples.push_back(static_cast<std::uint16_t>((i > 44 && i < 84 ? 3 : 3000) +
                                                           (7919 * (row * 128 + i)) % 1000));
  }
  std::mt19937 random(11);
  std::size_t refused = 0, accepted = 0;
  for (int i = 0; i < 60; ++i) {
    std::string bytes =
        tests::as_text(i % 2 == 0 ? encode_xtf({&written, 1}) : encode_jsf({&written, 1}));
    const auto place = [&](std::size_t end) { return random() % end; };
    switch (i / 2 % 6) {
      case 0: bytes.resize(place(bytes.size())); break;
      case 1:
        for (int k = 0; k < 40; ++k) bytes[place(bytes.size())] ^= static_cast<char>(random());
        break;
      case 2: bytes.erase(place(bytes.size()), 1 + place(5000)); break;
      case 3: bytes.insert(place(bytes.size()), std::string(1 + place(5000), '\xfa')); break;
      case 4:
        for (int k = 0; k < 30; ++k)
          bytes[place(std::min<std::size_t>(bytes.size(), 1600))] = '\xff';
        break;
      default: {  // all ranges, altitudes or samples
        const std::size_t from = place(bytes.size());
        std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(from),
                    std::min(bytes.size() - from, place(60000)), static_cast<char>(i));
      }
    }
    CAPTURE(i);
    const tests::TemporaryFolder folder;
    try {
      for (const RecordedLine& line :
           parse_recording(std::as_bytes(std::span(bytes)), "damaged.xtf"))
        imitate(line, folder.path(),
                {.threads = 1, .progress = [](auto, auto, auto) { return false; }});
    } catch (const RecordingError& error) {
      ++refused;
      CHECK(std::string(error.what()).size() > 20);
    } catch (const SceneError&) {
      ++refused;
    } catch (const Stopped&) {
      ++accepted;
    }
  }
  CHECK(refused > 5);
  CHECK(refused + accepted == 60);
}
