#pragma once

namespace ensonify::scatter {

// The noise of the sea itself as spectrum levels, in dB re 1 uPa^2/Hz: Coates, Underwater Acoustic
// Systems (1989), after Wenz, JASA 34, 1936 (1962). Each function throws std::invalid_argument for
// a frequency that is not above 0, and for another argument outside the stated range.

/// Turbulence, which matters below about 10 Hz: 17 - 30 lg f, f in kHz.
double turbulence_noise_db(double frequency_hz);

/// Distant ships; `shipping` s is 0 (none near) to 1 (heavy traffic): 40 + 20 (s - 0.5) + 26 lg f
/// - 60 lg(f + 0.03).
double shipping_noise_db(double frequency_hz, double shipping);

/// The sea surface under a wind of w = 0..60 m/s: 50 + 7.5 sqrt(w) + 20 lg f - 40 lg(f + 0.4).
double wind_noise_db(double frequency_hz, double wind_mps);

/// Thermal motion, which dominates above about 100 kHz: -15 + 20 lg f. (Mellen, JASA 24, 478
/// (1952), has 4 pi k T rho f^2 / c, which is 0.3 dB more.)
double thermal_noise_db(double frequency_hz);

/// The level of the sum of these four powers.
double ambient_noise_db(double frequency_hz, double wind_mps, double shipping);

}  // namespace ensonify::scatter
