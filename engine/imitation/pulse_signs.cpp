#include <ensonify/engine/imitation/pulse_signs.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace ensonify::engine {
namespace {

constexpr double clearly = 0.03;  // difference of correlations: more than relief and noise explain

Pulse sweep(PulseWindow window) {
  return {.kind = PulseKind::lfm, .bandwidth_hz = 1.0, .window = window};
}

/// Most recorders use a window. Without one, side lobes may fill the water column, so that only
/// clear evidence counts.
PulseWindow likely_of(double off_none, double off_hann) {
  return off_none < off_hann - clearly ? PulseWindow::none : PulseWindow::hann;
}

}  // namespace

double amplitude_correlation(double field_correlation) {
  const double square = field_correlation * field_correlation;
  double sum = 0.0, term = 0.25 * square;
  for (int n = 1; n < 30; ++n) {
    sum += term;
    term *= square * std::pow((n - 0.5) / (n + 1.0), 2);
  }
  return sum / (4.0 / std::numbers::pi - 1.0);
}

double time_times_bandwidth(const Pulse& pulse, double correlation) {
  const Pulse unit{.kind = pulse.kind, .bandwidth_hz = 1.0, .window = pulse.window};
  double low = 0.0, high = pulse.window == PulseWindow::hann ? 3.0 : 1.0;  // up to the first zero
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (low + high);
    (amplitude_correlation(unit.correlation(middle)) > correlation ? low : high) = middle;
  }
  return low;
}

Pulse likely_pulse(double over_one, double over_two) {
  const Pulse cw{.bandwidth_hz = 1.0};
  constexpr double long_enough = 0.3;
  if (over_one < long_enough) return cw;
  const auto off = [&](const Pulse& pulse) {
    const double apart = 2.0 * time_times_bandwidth(pulse, over_one);
    return std::abs(amplitude_correlation(pulse.correlation(apart)) - over_two);
  };
  const double off_none = off(sweep(PulseWindow::none)), off_hann = off(sweep(PulseWindow::hann));
  if (std::min(off_none, off_hann) >= off(cw) - clearly) return cw;
  return sweep(likely_of(off_none, off_hann));
}

PulseWindow likely_window(double time_times_bandwidth, double correlation) {
  const auto off = [&](PulseWindow window) {
    return std::abs(amplitude_correlation(sweep(window).correlation(time_times_bandwidth)) -
                    correlation);
  };
  return likely_of(off(PulseWindow::none), off(PulseWindow::hann));
}

}  // namespace ensonify::engine
