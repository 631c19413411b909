#include <ensonify/engine/imitation/pulse_signs.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace ensonify::engine {

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
  double low = 0.0, high = pulse.window == PulseWindow::hann ? 3.0 : 1.0;  // the first zero
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (low + high);
    (amplitude_correlation(unit.correlation(middle)) > correlation ? low : high) = middle;
  }
  return low;
}

Pulse likely_pulse(double over_one, double over_two) {
  const auto off = [&](const Pulse& pulse) {
    const double apart = 2.0 * time_times_bandwidth(pulse, over_one);
    return std::abs(amplitude_correlation(pulse.correlation(apart)) - over_two);
  };
  constexpr double clearly = 0.03, long_enough = 0.3;
  Pulse best{.bandwidth_hz = 1.0};
  if (over_one < long_enough) return best;
  double least = off(best) - clearly;
  for (const PulseWindow window : {PulseWindow::none, PulseWindow::hann}) {
    const Pulse sweep{.kind = PulseKind::lfm, .bandwidth_hz = 1.0, .window = window};
    if (off(sweep) >= least) continue;
    least = off(sweep);
    best = sweep;
  }
  return best;
}

}  // namespace ensonify::engine
