#pragma once

#include <ensonify/engine/sonar/instrument/pulse.h>

namespace ensonify::engine {

/// The least bandwidth of a model's sweep, as a share of the bandwidth of a pulse that is one
/// sample long. With less, the side lobes of the sweep would span more bins than a scene allows.
constexpr double min_bandwidth = 0.07;

/// The correlation of two Rayleigh amplitudes of equal power whose fields have the correlation rho:
/// (2F1(-1/2, -1/2; 1; rho^2) - 1) / (4 / pi - 1), from the mean of their product (Middleton, An
/// Introduction to Statistical Communication Theory, 1960).
double amplitude_correlation(double field_correlation);

/// The time, in units of 1 / bandwidth, after which the speckle of a pulse has an amplitude
/// correlation. Only times within the pulse's main lobe are searched.
double time_times_bandwidth(const Pulse& pulse, double correlation);

/// The kind and window of the pulse whose speckle has these correlations over one and over two
/// samples. CW, unless a sweep fits better by more than relief and noise can explain: pulses as
/// long as a sample or shorter cannot be distinguished. A sweep has a Hann window, unless a sweep
/// without a window fits clearly better.
Pulse likely_pulse(double over_one, double over_two);

/// The window of a sweep whose speckle has this correlation over a time; `time_times_bandwidth` is
/// this time times the bandwidth. Hann, unless no window fits clearly better.
PulseWindow likely_window(double time_times_bandwidth, double correlation);

}  // namespace ensonify::engine
