// What the correlation of samples shows of the pulse.

#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <vector>

#include "support/catch.h"

#include "made_line.h"

#include <ensonify/engine/imitation/pulse_signs.h>

using namespace ensonify;
using namespace ensonify::engine;
using tests::samples;

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
  // A sweep that fits with and without a window is assumed to have one, because most recorders use
  // one.
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
