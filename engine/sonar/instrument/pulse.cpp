#include <ensonify/engine/sonar/instrument/pulse.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <ensonify/engine/sonar/instrument/sinc.h>

namespace ensonify::engine {
namespace {

// x = B t where the amplitude's envelope, 1 / (pi x) or 1 / (pi x (x^2 - 1)), falls to -60 dB.
constexpr double sinc_reach = 318.3;
constexpr double hann_reach = 6.9;

// Integral from 0 to x of the triangle 1 - |s| on [-1, 1], the overlap of two bins.
double triangle_integral(double x) {
  const double s = std::min(std::abs(x), 1.0);
  return std::copysign(s - 0.5 * s * s, x);
}

/// The integral of a pulse's intensity times the overlap of two bins that are d bins apart, divided
/// by the length of a bin.
double overlap(const Pulse& pulse, double bin_s, int d) {
  // Simpson's rule on either side of the triangle's top, in steps that are short compared with a
  // bin and with a lobe.
  const double lobe_s = 1.0 / pulse.bandwidth_hz;
  const int steps = 2 * static_cast<int>(std::ceil(16.0 * std::max(1.0, bin_s / lobe_s)));
  const double step = 1.0 / steps;
  double sum = 0.0;
  for (int side : {-1, 1})
    for (int i = 0; i <= steps; ++i) {
      const double from_top = i * step;
      const double weight = i == 0 || i == steps ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
      sum += weight * (1.0 - from_top) * pulse.intensity((d + side * from_top) * bin_s);
    }
  return sum * step / 3.0;
}

/// Power spectrum of the samples of a CW pulse's speckle at a phase step per sample.
double cw_spectrum(const Pulse& pulse, double bin_s, double angle) {
  double sum = 1.0;
  for (int m = 1; m * bin_s < pulse.effective_length_s(); ++m)
    sum += 2.0 * pulse.correlation(m * bin_s) * std::cos(m * angle);
  return sum;
}

/// The power spectrum for a sweep. It is folded (aliased) at the sampling rate.
double sweep_spectrum(const Pulse& pulse, double bin_s, double angle) {
  using std::numbers::pi;
  const double half_band = 0.5 * pulse.bandwidth_hz;
  const int folds = static_cast<int>(half_band * bin_s) + 1;
  double sum = 0.0;
  for (int fold = -folds; fold <= folds; ++fold) {
    const double f = (angle / (2.0 * pi) + fold) / bin_s;
    if (std::abs(f) >= half_band) continue;
    const double c = std::cos(pi * f / pulse.bandwidth_hz);
    sum += pulse.window == PulseWindow::hann ? c * c * c * c : 1.0;
  }
  return sum;
}

/// The Fourier coefficients 0 to `highest` of an even function of the phase step.
template <class F>
std::vector<double> cosine_series(int highest, F&& function) {
  const int angles = std::max(2048, 32 * highest);
  std::vector<double> series(static_cast<std::size_t>(highest) + 1);
  for (int i = 0; i < angles; ++i) {
    const double angle = std::numbers::pi * (i + 0.5) / angles;
    const double value = function(angle);
    for (int d = 0; d <= highest; ++d)
      series[static_cast<std::size_t>(d)] += value * std::cos(d * angle) / angles;
  }
  return series;
}

/// The taps h on one side only whose autocorrelation is the pulse's: the spectral factor of minimum
/// phase, from the Fourier coefficients c of the logarithm of the spectrum (Oppenheim and Schafer,
/// Discrete-Time Signal Processing, 1989, ch. 12): h[0] = exp(c[0] / 2), and
/// n h[n] = sum over k = 1 .. n of k c[k] h[n - k].
std::vector<double> cw_taps(const Pulse& pulse, double bin_s) {
  // In bins; for a longer pulse a whole number of bins is close enough.
  constexpr double longest = 64.0;
  constexpr double least = 1e-12;  // value of the spectrum, which is 0 at some angles
  const double bins = std::max(pulse.effective_length_s() / bin_s, 1.0);
  if (bins > longest) return std::vector<double>(static_cast<std::size_t>(std::lround(bins)), 1.0);
  const int last = static_cast<int>(std::ceil(bins)) - 1;
  const std::vector<double> c = cosine_series(last, [&](double angle) {
    return std::log(std::max(cw_spectrum(pulse, bin_s, angle), least));
  });
  std::vector<double> taps{std::exp(0.5 * c[0])};
  for (std::size_t n = 1; n < c.size(); ++n) {
    double sum = 0.0;
    for (std::size_t k = 1; k <= n; ++k) sum += static_cast<double>(k) * c[k] * taps[n - k];
    taps.push_back(sum / static_cast<double>(n));
  }
  return taps;
}

/// The taps on either side of the even filter: the cosine series of the square root of the
/// spectrum.
std::vector<double> sweep_taps(const Pulse& pulse, double bin_s) {
  constexpr double left_out = 2e-3;  // share of the energy
  const int most =
      static_cast<int>(std::clamp(2.0 * pulse.effective_length_s() / bin_s, 24.0, 4096.0));
  std::vector<double> taps = cosine_series(
      most, [&](double angle) { return std::sqrt(sweep_spectrum(pulse, bin_s, angle)); });
  double total = -taps[0] * taps[0];
  for (const double tap : taps) total += 2.0 * tap * tap;
  double left = 0.0;
  while (taps.size() > 1 && left + 2.0 * taps.back() * taps.back() < left_out * total) {
    left += 2.0 * taps.back() * taps.back();
    taps.pop_back();
  }
  return taps;
}

}  // namespace

double Pulse::effective_length_s() const {
  if (kind == PulseKind::cw) return transmitted_length_s();
  // By Parseval, for the spectrum W: mean(W^2) / mean(W)^2 / B.
  return (window == PulseWindow::hann ? 1.5 : 1.0) / bandwidth_hz;
}

double Pulse::noise_bandwidth_hz() const {
  const double window_loss = kind == PulseKind::lfm ? effective_length_s() * bandwidth_hz : 1.0;
  return window_loss / transmitted_length_s();
}

double Pulse::amplitude(double time_s) const {
  if (kind == PulseKind::cw) return time_s >= begin_s() && time_s <= end_s() ? 1.0 : 0.0;
  const double x = bandwidth_hz * std::abs(time_s);
  if (window == PulseWindow::none) return sinc(x);
  return std::abs(x - 1.0) < 1e-6 ? 0.5 : sinc(x) / (1.0 - x * x);
}

double Pulse::intensity(double time_s) const {
  const double root = amplitude(time_s);
  return root * root;
}

double Pulse::correlation(double time_s) const {
  const double t = std::abs(time_s);
  if (kind == PulseKind::cw) return std::max(0.0, 1.0 - t / effective_length_s());
  const double x = bandwidth_hz * t;
  if (window == PulseWindow::none) return sinc(x);
  // The spectrum is cos^4 a = 3/8 + cos(2 a) / 2 + cos(4 a) / 8.
  return sinc(x) + (sinc(x - 1.0) + sinc(x + 1.0)) * 2.0 / 3.0 +
         (sinc(x - 2.0) + sinc(x + 2.0)) / 6.0;
}

double Pulse::begin_s() const { return kind == PulseKind::cw ? 0.0 : -end_s(); }

double Pulse::end_s() const {
  if (kind == PulseKind::cw) return effective_length_s();
  return (window == PulseWindow::hann ? hann_reach : sinc_reach) / bandwidth_hz;
}

double Pulse::closing_shift_s(double frequency_hz) const {
  return kind == PulseKind::lfm ? frequency_hz * transmitted_length_s() / bandwidth_hz : 0.0;
}

PulseKernel pulse_kernel(const Pulse& pulse, double sound_speed_mps, double bin_m) {
  const double cells = pulse.cell_m(sound_speed_mps) / bin_m;
  if (!(cells > 0.0 && bin_m > 0.0))
    throw std::invalid_argument("pulse_kernel: the pulse, its speed and the bin must be positive");
  const double bin_s = 2.0 * bin_m / sound_speed_mps;
  const double end = pulse.end_s() / bin_s;
  PulseKernel kernel;
  if (pulse.kind == PulseKind::cw) {
    for (int d = 0; d < end + 1.0; ++d)
      kernel.weights.push_back(triangle_integral(d) - triangle_integral(d - end));
    return kernel;
  }
  std::vector<double> half;  // the kernel is even
  for (int d = 0; d < end + 1.0; ++d) half.push_back(overlap(pulse, bin_s, d));
  kernel.first = 1 - static_cast<int>(half.size());
  kernel.weights.assign(half.rbegin(), half.rend());
  kernel.weights.insert(kernel.weights.end(), half.begin() + 1, half.end());
  double sum = 0.0;
  for (const double weight : kernel.weights) sum += weight;
  for (double& weight : kernel.weights) weight *= cells / sum;
  return kernel;
}

void spread_by_pulse(const PulseKernel& kernel, const double* energy, std::span<double> spread) {
  // If the kernel begins before the echo, it is even. The inner loops are over bins, so that the
  // compiler can use vector registers.
  const bool even = kernel.first < 0;
  const std::span<const double> pulse =
      std::span(kernel.weights).subspan(static_cast<std::size_t>(-kernel.first));
  for (std::size_t i = 0; i < spread.size(); ++i) spread[i] = pulse[0] * energy[i];
  for (std::size_t d = 1; d < pulse.size(); ++d) {
    const double* nearer = energy - d;
    if (even)
      for (std::size_t i = 0; i < spread.size(); ++i)
        spread[i] += pulse[d] * (energy[i + d] + nearer[i]);
    else
      for (std::size_t i = 0; i < spread.size(); ++i) spread[i] += pulse[d] * nearer[i];
  }
}

SpeckleFilter speckle_filter(const Pulse& pulse, double sound_speed_mps, double bin_m) {
  const double bin_s = 2.0 * bin_m / sound_speed_mps;
  const bool even = pulse.kind == PulseKind::lfm;
  const std::vector<double> taps = even ? sweep_taps(pulse, bin_s) : cw_taps(pulse, bin_s);
  double energy = even ? -taps[0] * taps[0] : 0.0;
  for (const double tap : taps) energy += (even ? 2.0 : 1.0) * tap * tap;
  SpeckleFilter filter{.even = even, .taps = {}};
  for (const double tap : taps) filter.taps.push_back(static_cast<float>(tap / std::sqrt(energy)));
  return filter;
}

}  // namespace ensonify::engine
