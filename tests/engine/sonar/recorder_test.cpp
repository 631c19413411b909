#include <ensonify/engine/sonar/reception/recorder.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "support/catch.h"
#include "support/lines.h"

using namespace ensonify::engine;
using namespace ensonify::tests;

TEST_CASE(
    "a sample is the amplitude after gain, curve, clipping and digitiser, which can be inverted") {
  for (const TransferCurve curve :
       {TransferCurve::linear, TransferCurve::square_root, TransferCurve::logarithmic})
    for (const int bits : {8, 15, 16}) {
      const Recorder recorder({.gain_db = 0.0, .curve = curve, .bits = bits}, 0.05, 100, 0.1, 0.0);
      CAPTURE(static_cast<int>(curve), bits);
      CHECK(recorder.full_scale() == (1u << bits) - 1);
      CHECK(recorder.sample(1.0f) == recorder.full_scale());
      CHECK(recorder.sample(7.0f) == recorder.full_scale());
      CHECK(recorder.sample(0.0f) == 0);
      std::uint32_t before = 0;
      for (double amplitude = 0.01; amplitude < 1.0; amplitude *= 1.2) {
        const std::uint32_t sample = recorder.sample(static_cast<float>(amplitude));
        CHECK(sample >= before);
        before = sample;
        // Half a step, and the same in amplitude.
        const double next =
            recorder.amplitude(sample + 1) - recorder.amplitude(sample - (sample > 0));
        CHECK(std::abs(recorder.amplitude(sample) - amplitude) <= 0.5 * next + 1e-6);
      }
    }
  const Recorder half({.gain_db = 0.0, .curve = TransferCurve::square_root, .bits = 8}, 1, 1, 0, 0);
  CHECK(half.sample(0.25f) == 128);
  const Recorder log(
      {.gain_db = 0.0, .curve = TransferCurve::logarithmic, .curve_range_db = 60.0, .bits = 8}, 1,
      1, 0, 0);
  CHECK(log.sample(static_cast<float>(std::pow(10.0, -1.499))) == 128);  // -30 dB
  CHECK(log.sample(1e-4f) == 0);
}

TEST_CASE("the time-varied gain compensates spreading and absorption") {
  const Recorder recorder({.spreading = 30.0, .gain_db = -100.0}, 0.1, 1000, 0.05, 7.0);
  const double near = recorder.gain(99), far = recorder.gain(999);
  const double ratio = 99.95 / 9.95;
  CHECK(20.0 * std::log10(far / near) ==
        Approx(30.0 * std::log10(ratio) + 2.0 * 0.05 * 90.0).margin(1e-3));
  CHECK(20.0 * std::log10(far) ==
        Approx(-100.0 + 30.0 * std::log10(99.95) + 0.1 * 99.95).margin(1e-3));
  const Recorder plain({.spreading = 30.0, .absorption = false}, 0.1, 1000, 0.05, 7.0);
  CHECK(20.0 * std::log10(double(plain.gain(999))) ==
        Approx(7.0 + 30.0 * std::log10(99.95)).margin(1e-3));
}

TEST_CASE("where absorption leaves nothing of the bed, silence is recorded as silence") {
  constexpr double no_bed_db = std::numeric_limits<double>::infinity();
  for (const double automatic_gain_db : {0.0, 700.0, no_bed_db}) {
    const Recorder recorder({}, 0.1, 1000, 10.0, automatic_gain_db);  // 2000 dB at 100 m
    for (const float gain : recorder.gains()) {
      REQUIRE(recorder.sample(0.0f * gain * gain) == 0);
      REQUIRE(std::isfinite(1e4f * gain * gain));
    }
  }
}

TEST_CASE("a detector records the mean or the largest of its looks' amplitudes") {
  // The mean of Rayleigh amplitudes is sqrt(pi)/2 per look; the largest of two is 2 - 1/sqrt(2)
  // times that on average.
  for (const Detector detector : {Detector::mean, Detector::peak}) {
    Sonar sonar = quiet_sonar();
    sonar.receiver.looks = 2;
    sonar.receiver.detector = detector;
    sonar.receiver.spreading = 0.0;
    sonar.receiver.absorption = false;
    sonar.receiver.gain_db = -40.0;  // full scale is an amplitude of 100
    const SignalChain chain(sonar, {});
    SignalChain::Scratch scratch;
    double sum = 0.0;
    int count = 0;
    for (int ping = 0; ping < 60; ++ping) {
      const Eigen::Vector3d array{0.0, 5.0 * ping, -10.0};
      EchoLine line = level_line(sonar, starboard_sector, array, 10.0);
      for (float& mean : line.bins.intensity_mean) mean *= 100.0f;
      receive_lines(chain, {.array = {array, {0, 1, 0}}}, std::span(&line, 1), scratch);
      for (std::size_t i = 300; i < line.bins.sample.size(); ++i, ++count)
        sum += 100.0 * chain.recorder().amplitude(line.bins.sample[i]);
    }
    const double rayleigh = 10.0 * std::sqrt(std::acos(-1.0)) / 2.0;
    CHECK(sum / count ==
          Approx(detector == Detector::mean ? rayleigh : rayleigh * (2.0 - 1.0 / std::sqrt(2.0)))
              .epsilon(0.01));
  }
}

TEST_CASE("the automatic gain records the nominal bed at half the range at bed_level_db") {
  Sonar sonar = quiet_sonar();
  const double strength_db = GENERATE(-45.0, -20.0), bed_level_db = GENERATE(-16.0, -27.0);
  sonar.receiver.bed_level_db = bed_level_db;
  const ChainOptions options{
      .speckle = false,
      .absorption_db_per_m = 0.08,
      .nominal_altitude_m = 8.0,
      .nominal_strength = [=](double) { return std::pow(10.0, strength_db / 10.0); }};
  const SignalChain chain(sonar, options);
  const double r = (750 + 0.5) * sonar.bin_m(), sine = 8.0 / r;
  const double cosine = std::sqrt(1.0 - sine * sine);
  const Scatterers scatterers(sonar, 1500.0, 1, 0.0);
  const double level_db =
      sonar.source_level_db - 40.0 * std::log10(r) - 2.0 * 0.08 * r + strength_db +
      10.0 * std::log10(scatterers.width_m(750) * sonar.pulse.cell_m(1500.0) / cosine *
                        std::pow(sonar.vertical.power(std::asin(sine), starboard_sector), 2));
  CHECK(level_db + 20.0 * std::log10(double(chain.recorder().gain(750))) ==
        Approx(bed_level_db).margin(0.02));
}

TEST_CASE("noise after the gain has its level in the samples at all ranges, whatever the gain") {
  for (const double spreading : {0.0, 40.0}) {
    Sonar sonar = quiet_sonar();
    sonar.receiver.output_noise_db = -30.0;
    sonar.receiver.spreading = spreading;
    const SignalChain chain(sonar, {});
    SignalChain::Scratch scratch;
    EchoLine line;
    line.bins.assign(static_cast<std::size_t>(sonar.bins));
    double near = 0.0, far = 0.0;
    constexpr int pings = 100;
    for (std::uint64_t ping = 0; ping < pings; ++ping) {
      receive_lines(chain, {.ping = ping}, std::span(&line, 1), scratch);
      for (std::size_t i = 0; i < line.bins.sample.size(); ++i)
        (i < line.bins.sample.size() / 2 ? near : far) +=
            std::pow(chain.recorder().amplitude(line.bins.sample[i]), 2);
    }
    const double mean = (near + far) / pings / sonar.bins;
    CHECK(10.0 * std::log10(mean) == Approx(-30.0).margin(0.1));
    CHECK(near / far == Approx(1.0).epsilon(0.02));
    CHECK(*std::ranges::max_element(line.bins.intensity) ==
          0.0f);  // noise after the gain is not received from the water
  }
}

TEST_CASE("noise after the gain changes slowly along the line, equally on both sides") {
  constexpr double rms_db = 3.0, correlation_s = 5.0;
  constexpr std::size_t pings = 2000, per_correlation = 10;
  Sonar sonar = quiet_sonar();
  sonar.receiver.output_noise_db = -40.0;
  sonar.receiver.output_noise_wander_db = rms_db;
  sonar.receiver.output_noise_wander_s = correlation_s;
  const auto levels_of = [&](const Sector& sector, std::uint64_t sonar_number) {
    const SignalChain chain(sonar, {.sonar_number = sonar_number});
    SignalChain::Scratch scratch;
    EchoLine line;
    line.sector = sector.number;
    line.bins.assign(static_cast<std::size_t>(sonar.bins));
    std::vector<double> levels_db;
    for (std::uint64_t ping = 0; ping < pings; ++ping) {
      receive_lines(
          chain, {.ping = ping, .t_s = correlation_s / per_correlation * static_cast<double>(ping)},
          std::span(&line, 1), scratch);
      double power = 0.0;
      for (const std::uint16_t sample : line.bins.sample)
        power += std::pow(chain.recorder().amplitude(sample), 2) / sonar.bins;
      levels_db.push_back(10.0 * std::log10(power));
    }
    return levels_db;
  };
  const std::vector<double> port = levels_of(port_sector, 0),
                            starboard = levels_of(starboard_sector, 0),
                            other = levels_of(port_sector, 1);
  const auto mean_product = [](const std::vector<double>& a, const std::vector<double>& b,
                               std::size_t lag) {
    double sum = 0.0;
    for (std::size_t i = 0; i + lag < a.size(); ++i) sum += (a[i] + 40.0) * (b[i + lag] + 40.0);
    return sum / static_cast<double>(a.size() - lag);
  };
  // The speckle of a ping's bins also changes its mean, by much less.
  CHECK(std::sqrt(mean_product(port, port, 0)) == Approx(rms_db).epsilon(0.1));
  CHECK(mean_product(port, starboard, 0) == Approx(mean_product(port, port, 0)).epsilon(0.02));
  // The correlation of motion.h.
  CHECK(mean_product(port, port, per_correlation) / mean_product(port, port, 0) ==
        Approx(std::exp(-0.5)).margin(0.1));
  CHECK(std::abs(mean_product(port, other, 0)) < 0.3 * mean_product(port, port, 0));
}

TEST_CASE(
    "a recorder that scales each ping gives all the same mean, and keeps the received intensity") {
  Sonar sonar;
  sonar.receiver.looks = 3;
  sonar.receiver.detector = Detector::peak;
  sonar.receiver.output_noise_db = -60.0;
  const SignalChain plain(sonar, {.arrivals = {.burst_m = 0.3}});
  sonar.receiver.ping_mean = 0.2;
  const SignalChain scaled(sonar, {.arrivals = {.burst_m = 0.3}});
  SignalChain::Scratch scratch;
  for (const float strength : {1e4f, 1e7f, 1e9f}) {
    EchoLine line = level_line(sonar, starboard_sector, {0, 0, -10}, 10.0);
    for (float& mean : line.bins.intensity_mean) mean *= strength;
    EchoLine without = line;
    receive_lines(scaled, {}, std::span(&line, 1), scratch);
    receive_lines(plain, {}, std::span(&without, 1), scratch);
    CHECK(line.artefacts.has(Artefact::automatic_gain));
    CHECK_FALSE(without.artefacts.has(Artefact::automatic_gain));
    REQUIRE(line.bins.intensity == without.bins.intensity);
    const auto behind_burst = static_cast<std::size_t>(0.9 / sonar.bin_m());
    double sum = 0.0, clipped = 0.0;
    for (std::size_t i = behind_burst; i < line.bins.sample.size(); ++i) {
      sum += line.bins.sample[i];
      clipped += line.bins.sample[i] == scaled.recorder().full_scale();
    }
    const double bins = static_cast<double>(line.bins.sample.size() - behind_burst);
    CAPTURE(strength, clipped);
    CHECK(sum / bins / scaled.recorder().full_scale() ==
          Approx(0.2).margin(0.1 * clipped / bins + 1e-4));
  }
}
