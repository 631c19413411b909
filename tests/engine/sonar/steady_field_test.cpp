#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "support/catch.h"

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/sonar/echo/steady_field.h>

using namespace ensonify;
using namespace ensonify::engine;
using Complex = std::complex<double>;

namespace {

constexpr double speed_mps = 1500.0, band_hz = 10e3;
constexpr double lobe_m = 0.5 * speed_mps / band_hz;  // of 1 / B

const Pulse band_tone{.kind = PulseKind::cw, .bandwidth_hz = band_hz};
const Pulse long_sweep{.kind = PulseKind::lfm, .bandwidth_hz = band_hz, .length_s = 10e-3};
const Pulse long_hann{.kind = PulseKind::lfm,
                      .bandwidth_hz = band_hz,
                      .length_s = 10e-3,
                      .window = PulseWindow::hann};

/// The pulse's amplitude x lobes behind the echo's range, written out again.
double amplitude(const Pulse& pulse, double x) {
  using std::numbers::pi;
  if (pulse.kind == PulseKind::cw) return x >= 0.0 && x < 1.0 ? 1.0 : 0.0;
  if (std::abs(x) < 1e-9) return 1.0;
  const double plain = std::sin(pi * x) / (pi * x);
  return pulse.window == PulseWindow::hann ? plain / (1.0 - x * x + 1e-12) : plain;
}

/// Integral of p(t) p(t - x) over that of p^2: a triangle; the transforms of a flat band and of
/// cos^4 (a sum over the band, which is exact for a series of cosines).
double overlap(const Pulse& pulse, double x) {
  if (pulse.kind == PulseKind::cw) return std::max(0.0, 1.0 - std::abs(x));
  constexpr int steps = 4000;
  double sum = 0.0, whole = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double f = (i + 0.5) / steps - 0.5;
    const double weight =
        pulse.window == PulseWindow::hann ? std::pow(std::cos(std::numbers::pi * f), 4.0) : 1.0;
    sum += weight * std::cos(2.0 * std::numbers::pi * f * x);
    whole += weight;
  }
  return sum / whole;
}

struct Echo {
  double range_m;
  Complex amplitude;
};

std::vector<double> intensities(const Pulse& pulse, double bin_m, std::size_t bins,
                                const std::vector<Echo>& echoes) {
  SteadyField field(pulse, speed_mps, bin_m, bins);
  for (const Echo& echo : echoes) field.add(echo.range_m, echo.amplitude);
  std::vector<float> re, im;
  field.write(re, im);
  std::vector<double> all;
  for (std::size_t i = 0; i < re.size(); ++i)
    all.push_back(double(re[i]) * double(re[i]) + double(im[i]) * double(im[i]));
  return all;
}

}  // namespace

TEST_CASE("two steady echoes have the energy of their overlap in time, whatever the bins") {
  for (const Pulse& pulse : {band_tone, long_sweep, long_hann})
    for (const int bins_per_lobe : {1, 2, 4, 16})
      for (const double gap : {0.0, 0.1, 0.25, 0.5, 0.9, 1.01, 1.5, 2.0})
        for (const double phase : {0.0, 1.0, 2.0, std::numbers::pi}) {
          const double bin_m = lobe_m / bins_per_lobe, begin_m = 30.0123;
          const auto bins = static_cast<std::size_t>(60.0 / bin_m);
          const Complex other = 0.8 * std::polar(1.0, phase);
          double energy = 0.0;
          for (const double one :
               intensities(pulse, bin_m, bins, {{begin_m, 1.0}, {begin_m + gap * lobe_m, other}}))
            energy += one;
          const double cells = pulse.cell_m(speed_mps) / bin_m;
          const double expected = 1.0 + 0.64 + 2.0 * 0.8 * std::cos(phase) * overlap(pulse, gap);
          CAPTURE(static_cast<int>(pulse.kind), static_cast<int>(pulse.window), bins_per_lobe, gap,
                  phase);
          CHECK(energy / cells == Approx(expected).margin(0.004));
        }
}

TEST_CASE("each bin of steady echoes has the mean of the square of their field in it") {
  for (const Pulse& pulse : {band_tone, long_sweep, long_hann})
    for (const double bins_per_lobe : {0.3, 1.0, 2.0, 4.0, 7.3})
      for (std::uint64_t seed = 0; seed < 4; ++seed) {
        const double bin_m = lobe_m / bins_per_lobe;
        const std::size_t bins = 64;
        std::array<double, 15> random;
        RandomStream(seed, Purpose::test).uniform(random);
        std::vector<Echo> echoes;
        for (std::size_t i = 0; i < random.size(); i += 3)
          echoes.push_back(
              {(8.0 + 3.0 * random[i]) * lobe_m,
               std::polar(0.2 + random[i + 1], 2.0 * std::numbers::pi * random[i + 2])});
        const std::vector<double> got = intensities(pulse, bin_m, bins, echoes);
        std::vector<double> expected(bins);
        constexpr int steps = 2000;
        double most = 0.0;
        for (std::size_t n = 0; n < bins; ++n) {
          for (int i = 0; i < steps; ++i) {
            const double at_m = (static_cast<double>(n) + (i + 0.5) / steps) * bin_m;
            Complex sum = 0.0;
            for (const Echo& echo : echoes)
              sum += echo.amplitude * amplitude(pulse, (at_m - echo.range_m) / lobe_m);
            expected[n] += std::norm(sum) / steps;
          }
          most = std::max(most, expected[n]);
        }
        CAPTURE(static_cast<int>(pulse.kind), static_cast<int>(pulse.window), bins_per_lobe, seed);
        for (std::size_t n = 0; n < bins; ++n)
          CHECK(got[n] == Approx(expected[n]).margin(0.025 * most));
      }
}

TEST_CASE("a steady field has the phase of its echo, and keeps nothing from ping to ping") {
  for (const Pulse& pulse : {band_tone, long_sweep}) {
    SteadyField field(pulse, speed_mps, 0.5 * lobe_m, 100);
    std::vector<float> re, im;
    field.add(20.1 * lobe_m, std::polar(2.0, 0.7));
    field.write(re, im);
    const std::size_t bin = 41;
    CHECK(std::arg(Complex(re[bin], im[bin])) == Approx(0.7).margin(1e-5));
    field.write(re, im);
    CHECK(re.empty());
    field.add(20.1 * lobe_m, 1.0);
    field.write(re, im);
    CHECK(std::abs(im[bin]) < 1e-6f);
    // An echo beyond the last bin, or before the first, adds what reaches into the bins.
    field.add(-0.5 * lobe_m, 1.0);
    field.add(200.0 * lobe_m, 1.0);
    field.write(re, im);
    CHECK(re[0] > 0.1f);
    CHECK(re.size() == 100);
  }
  CHECK_THROWS_AS(SteadyField(band_tone, speed_mps, 0.0, 10), std::invalid_argument);
}

TEST_CASE(
    "in bins far longer than a sweep's cell a steady echo keeps its energy, in little memory") {
  const double bin_m = 1000.0 * lobe_m;
  const std::vector<double> got = intensities(long_sweep, bin_m, 40, {{20.4 * bin_m, 3.0}});
  double energy = 0.0;
  for (const double one : got) energy += one;
  CHECK(energy == Approx(9.0 * lobe_m / bin_m).epsilon(0.01));
}
