#include <ensonify/engine/sonar/instrument/pulse.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>

#include "support/catch.h"

#include <ensonify/engine/sonar/instrument/sonar.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify::engine;
using ensonify::scatter::to_db;

namespace {

constexpr double sound_speed_mps = 1500.0;
constexpr Pulse tone{.bandwidth_hz = 20e3};
constexpr Pulse sweep{.kind = PulseKind::lfm, .bandwidth_hz = 20e3};
constexpr Pulse hann{.kind = PulseKind::lfm, .bandwidth_hz = 20e3, .window = PulseWindow::hann};

double sum_of(const std::vector<double>& kernel) {
  return std::accumulate(kernel.begin(), kernel.end(), 0.0);
}

/// The kernel's highest side lobe over its peak, with bins much shorter than a cell.
double side_lobe_db(const Pulse& pulse) {
  const PulseKernel both =
      pulse_kernel(pulse, sound_speed_mps, pulse.cell_m(sound_speed_mps) / 64.0);
  const std::vector<double> kernel(both.weights.begin() - both.first, both.weights.end());
  std::size_t null = 1;
  while (kernel[null] < kernel[null - 1]) ++null;
  return to_db(*std::max_element(kernel.begin() + static_cast<std::ptrdiff_t>(null), kernel.end()) /
               kernel.front());
}

/// The width of the intensity, -3 dB to -3 dB, times the bandwidth.
double width(const Pulse& pulse) {
  double begin = 0.0, end = 0.0;
  while (pulse.intensity(end / pulse.bandwidth_hz) > 0.5) end += 1e-5;
  while (pulse.intensity(begin / pulse.bandwidth_hz) > 0.5) begin -= 1e-5;
  return end - begin;
}

}  // namespace

TEST_CASE("a kernel sums to its range cell over the bin, whatever the pulse, long or short") {
  for (const Pulse& shape : {tone, sweep, hann})
    for (const double cell_m : {0.001, 0.025, 0.05, 0.0731, 1.0})
      for (const double bin_m : {0.01, 0.05, 0.5}) {
        Pulse pulse = shape;
        pulse.bandwidth_hz = 0.5 * sound_speed_mps / cell_m;
        const std::vector<double> kernel = pulse_kernel(pulse, sound_speed_mps, bin_m).weights;
        CHECK(sum_of(kernel) == Approx(pulse.cell_m(sound_speed_mps) / bin_m).epsilon(1e-12));
        CHECK(*std::min_element(kernel.begin(), kernel.end()) >= 0.0);
      }
}

TEST_CASE("a tone's kernel begins at the echo's bin, a sweep's peaks there and is even") {
  for (const double bin_m : {0.01, 0.0375, 0.05, 0.3}) {
    const PulseKernel cw = pulse_kernel(tone, sound_speed_mps, bin_m);
    CAPTURE(bin_m);
    CHECK(cw.first == 0);
    // The middle of the intensity is half a cell behind the energy's.
    double sum = 0.0, moment = 0.0;
    for (std::size_t i = 0; i < cw.weights.size(); ++i) {
      sum += cw.weights[i];
      moment += cw.weights[i] * double(i);
    }
    CHECK(moment / sum * bin_m == Approx(0.5 * tone.cell_m(sound_speed_mps)).epsilon(1e-9));
    for (const Pulse& pulse : {sweep, hann}) {
      const PulseKernel kernel = pulse_kernel(pulse, sound_speed_mps, bin_m);
      const std::size_t size = kernel.weights.size();
      REQUIRE(size == std::size_t(1 - 2 * kernel.first));
      for (std::size_t i = 0; i < size; ++i)
        REQUIRE(kernel.weights[i] == kernel.weights[size - 1 - i]);
      CHECK(*std::max_element(kernel.weights.begin(), kernel.weights.end()) ==
            kernel.weights[std::size_t(-kernel.first)]);
    }
  }
}

TEST_CASE("a sweep's first side lobe is 13.3 dB down, with a Hann window 31.5 dB") {
  CHECK(side_lobe_db(sweep) == Approx(-13.26).margin(0.02));
  CHECK(side_lobe_db(hann) == Approx(-31.47).margin(0.02));
}

TEST_CASE(
    "a sweep is 0.886 / B wide at -3 dB, with a Hann window 1.44 / B, a tone its whole length") {
  CHECK(width(sweep) == Approx(0.8859).epsilon(1e-3));
  CHECK(width(hann) == Approx(1.4407).epsilon(1e-3));
  CHECK(width(tone) == Approx(1.0).epsilon(1e-3));
}

TEST_CASE("a pulse's effective length is its energy over its peak") {
  for (const Pulse& pulse : {tone, sweep, hann}) {
    double energy_s = 0.0;
    const double step_s = 0.01 / pulse.bandwidth_hz;
    for (double t = 0.5 * step_s; t < 2000.0 / pulse.bandwidth_hz; t += step_s)
      energy_s += (pulse.intensity(t) + pulse.intensity(-t)) * step_s;
    CHECK(energy_s == Approx(pulse.effective_length_s()).epsilon(2e-4));
  }
  Pulse longer = tone;
  longer.length_s = 3e-4;
  CHECK(longer.effective_length_s() == 3e-4);
}

TEST_CASE("a Hann window over a sweep's matched filter raises the noise by 1.76 dB") {
  // From the spectrum: after a filter w that keeps an echo's peak, which is the sum of w, white
  // noise has the power sum(w^2) / sum(w)^2.
  constexpr int steps = 1000;
  double sum = 0.0, squares = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double w = 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * (i + 0.5) / steps);
    sum += w / steps;
    squares += w * w / steps;
  }
  CHECK(to_db(hann.noise_bandwidth_hz() / sweep.noise_bandwidth_hz()) ==
        Approx(to_db(squares / (sum * sum))).epsilon(1e-9));
  CHECK(to_db(squares / (sum * sum)) == Approx(1.76).margin(0.005));
  CHECK(sweep.noise_bandwidth_hz() == Approx(20e3));
  CHECK(tone.noise_bandwidth_hz() == Approx(20e3));
  Pulse longer = tone;
  longer.length_s = 3e-4;
  CHECK(longer.noise_bandwidth_hz() == Approx(1.0 / 3e-4));
}

TEST_CASE("a sweep's matched filter gains 10 log10(B T) over the noise of a tone of 1 / B") {
  // The signal to noise of a matched filter depends on the energy alone (Turin, IRE Trans. Inf.
  // Theory 6, 311, 1960).
  Pulse short_tone{.bandwidth_hz = 20e3};
  for (const double length_s : {50e-6, 1e-3, 10e-3}) {
    const Pulse chirp{.kind = PulseKind::lfm, .bandwidth_hz = 20e3, .length_s = length_s};
    CHECK(to_db(short_tone.noise_bandwidth_hz() / chirp.noise_bandwidth_hz()) ==
          Approx(to_db(20e3 * length_s)).margin(1e-9));
    CHECK(chirp.effective_length_s() == Approx(short_tone.effective_length_s()));
  }
  // A sweep of B T = 400, compressed: the filter is the sweep itself.
  const double bandwidth_hz = 20e3, length_s = 20e-3, rate_hz = 400e3;
  const Pulse chirp{.kind = PulseKind::lfm, .bandwidth_hz = bandwidth_hz, .length_s = length_s};
  const auto samples = static_cast<int>(length_s * rate_hz);
  std::vector<std::complex<double>> sent;
  for (int i = 0; i < samples; ++i) {
    const double t = (i - 0.5 * samples) / rate_hz;
    sent.push_back(std::polar(1.0, std::numbers::pi * bandwidth_hz / length_s * t * t));
  }
  const auto compressed = [&](int lag) {
    std::complex<double> sum = 0.0;
    for (int i = lag; i < samples; ++i)
      sum += sent[static_cast<std::size_t>(i)] * std::conj(sent[static_cast<std::size_t>(i - lag)]);
    return sum / rate_hz;
  };
  const double peak = std::norm(compressed(0));
  for (int lag = 0; lag < 60; ++lag)
    CHECK(std::norm(compressed(lag)) / peak == Approx(chirp.intensity(lag / rate_hz)).margin(5e-3));
  // White noise of the density 1 leaves a filter with the energy of its impulse response.
  double energy = 0.0;
  for (const std::complex<double>& value : sent) energy += std::norm(value) / rate_hz;
  CHECK(chirp.noise_bandwidth_hz() == Approx(energy / peak));
}

TEST_CASE("the echo of a point that closes is compressed nearer, by its speed times f T / B") {
  // A second implementation. For each time of arrival, the exact paths to and from the moving point
  // give the time at which that sound was sent, and so the phase of the echo. The echo is then
  // correlated with the sweep that was sent.
  constexpr double pi = std::numbers::pi, c = sound_speed_mps;
  for (const double frequency_hz : {100e3, 400e3})
    for (const double length_s : {2e-3, 10e-3})
      for (const double closing_mps : {2.0, 0.5, -1.0}) {
        const Pulse chirp{.kind = PulseKind::lfm, .bandwidth_hz = 20e3, .length_s = length_s};
        const double first_m = 20.0, rate = chirp.bandwidth_hz / length_s, step_s = 1.0 / 80e3;
        const auto sweep_phase = [&](double t) {  // turns, about the middle frequency
          return 0.5 * rate * (t - 0.5 * length_s) * (t - 0.5 * length_s);
        };
        // Sent at t_e, reflected at t_r where c (t_r - t_e) = R - v t_r, back at t = 2 t_r - t_e.
        const auto sent_s = [&](double t) {
          return (t * (c + closing_mps) - 2.0 * first_m) / (c - closing_mps);
        };
        const auto power_at = [&](double range_m) {
          std::complex<double> sum = 0.0;
          for (double u = 0.5 * step_s; u < length_s; u += step_s) {
            const double t = u + 2.0 * range_m / c, te = sent_s(t);
            if (te < 0.0 || te > length_s) continue;
            const double turns = frequency_hz * (te - t) + sweep_phase(te) - sweep_phase(u);
            sum += std::polar(1.0, 2.0 * pi * turns);
          }
          return std::norm(sum);
        };
        double best_m = 0.0, best = 0.0;
        for (double range_m = first_m - 0.6; range_m < first_m + 0.6; range_m += 0.5e-3)
          if (const double power = power_at(range_m); power > best) best = power, best_m = range_m;
        // Where the point is when the middle of the pulse meets it.
        const double met_s = (first_m + 0.5 * c * length_s) / (c + closing_mps);
        const double range_m = first_m - closing_mps * met_s;
        CAPTURE(frequency_hz, length_s, closing_mps);
        CHECK(best_m - range_m == Approx(-closing_mps * chirp.closing_shift_s(frequency_hz))
                                      .epsilon(0.005)
                                      .margin(2e-3));  // of a lobe of 37 mm
      }
  const Pulse example{.kind = PulseKind::lfm, .bandwidth_hz = 20e3, .length_s = 10e-3};
  CHECK(2.0 * example.closing_shift_s(400e3) == Approx(0.4));
  CHECK(tone.closing_shift_s(400e3) == 0.0);
}

TEST_CASE("before its begin and behind its end a pulse stays below -60 dB") {
  for (const Pulse& pulse : {tone, sweep, hann})
    for (double x = 1.0; x < 40.0; x += 0.01) {
      const double beyond_s = 1e-12 + (x - 1.0) / pulse.bandwidth_hz;
      CHECK(pulse.intensity(pulse.end_s() * (1.0 + 1e-9) + beyond_s) <= 1e-6);
      CHECK(pulse.intensity(pulse.begin_s() * (1.0 + 1e-9) - beyond_s) <= 1e-6);
    }
}

TEST_CASE("a digitiser's bins are c / 2 rate long and reach the range") {
  Sonar sonar;
  sonar.range_m = 50.0;
  sonar.bins = 7;
  CHECK(sonar.sampled(1500.0).bins == 7);
  sonar.sample_rate_hz = 60e3;
  CHECK(sonar.sampled(1500.0).bins == 4000);
  CHECK(sonar.sampled(1500.0).range_m == Approx(50.0));
  const Sonar slower = sonar.sampled(1487.0);
  CHECK(slower.bin_m() == Approx(1487.0 / 120e3));
  CHECK(slower.range_m >= 50.0);
  CHECK(slower.range_m < 50.0 + slower.bin_m());
}

TEST_CASE("speckle of a CW pulse of any length is correlated as the pulse: a triangle") {
  for (const double bins : {0.3, 1.0, 1.5, 2.5, 4.0, 15.0, 16.5, 60.0, 119.0, 300.4}) {
    const Pulse pulse{.kind = PulseKind::cw, .length_s = bins * 1e-5};
    const SpeckleFilter filter = speckle_filter(pulse, 1500.0, 0.5 * 1500.0 * 1e-5);
    REQUIRE(!filter.even);
    for (std::size_t lag = 0; lag < filter.taps.size() + 2; ++lag) {
      double sum = 0.0;
      for (std::size_t k = 0; k + lag < filter.taps.size(); ++k)
        sum += double(filter.taps[k]) * double(filter.taps[k + lag]);
      CAPTURE(bins, lag);
      CHECK(sum ==
            Approx(std::max(1.0 - double(lag) / bins, 0.0)).margin(bins < 64.0 ? 5e-4 : 2e-3));
    }
  }
}

TEST_CASE("the filter of a CW pulse sums as many scatterers as the pulse is bins long") {
  // The number of independent scatterers in a sum with the weights h is (sum h^2)^2 / sum h^4.
  // A filter of so few taps cannot be a box and have the correlation of a pulse between whole bins.
  for (const double bins : {1.0, 2.0, 2.5, 4.0, 15.0, 16.0, 16.5, 60.0, 119.0}) {
    const Pulse pulse{.kind = PulseKind::cw, .length_s = bins * 1e-5};
    double fourth = 0.0;
    for (const float tap : speckle_filter(pulse, 1500.0, 0.5 * 1500.0 * 1e-5).taps)
      fourth += std::pow(double(tap), 4);
    CAPTURE(bins);
    CHECK(1.0 / fourth == Approx(bins).epsilon(bins == std::floor(bins) ? 1e-3 : 0.16));
  }
}
