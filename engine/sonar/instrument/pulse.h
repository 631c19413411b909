#pragma once

#include <vector>

namespace ensonify::engine {

enum class PulseKind { cw, lfm };
enum class PulseWindow { none, hann };

/// What is sent, as far as the echoes' energy goes.
///
/// A CW pulse returns as a box of its length. A linear sweep (LFM) returns, after the matched
/// filter, as the transform of its even spectrum: an intensity of sinc^2(B t), whose first side
/// lobe is 13.3 dB down and whose -3 dB width is 0.886 / B; or with a Hann window over the spectrum
/// (sinc(B t) / (1 - (B t)^2))^2: 31.5 dB and 1.44 / B.
struct Pulse {
  PulseKind kind = PulseKind::cw;
  double bandwidth_hz = 30e3;
  double length_s = 0.0;                   ///< of a CW pulse; 0: 1 / bandwidth
  PulseWindow window = PulseWindow::none;  ///< of a sweep's spectrum

  /// Energy over peak intensity: a CW pulse's length, 1 / B of a sweep, 1.5 / B under a Hann
  /// window.
  double effective_length_s() const;
  /// White noise behind the matched filter over its spectral density, where an echo's peak is what
  /// it is without a window: a sweep's bandwidth, times mean(w^2) / mean(w)^2 of the window w, 1.5
  /// (1.76 dB) of Hann's; 1 / length of a CW pulse.
  double noise_bandwidth_hz() const;
  /// Intensity over its peak, so long before or after the middle.
  double intensity(double time_s) const;
  /// Amplitude of developed speckle at two times so far apart, their correlation: of the pulse with
  /// itself.
  double correlation(double time_s) const;
  /// How long before or after the middle anything above -60 dB is left.
  double reach_s() const;
  /// The range cell, c tau_e / 2.
  double cell_m(double sound_speed_mps) const {
    return 0.5 * sound_speed_mps * effective_length_s();
  }
};

/// What a pulse makes of neighbouring bins: kernel[d] is the intensity in a bin per energy in the
/// bin d places off, either way; bins are averages over their own length. What lies beyond the
/// pulse's reach is left out, and the whole kernel, both ways, sums to cell / bin nevertheless: an
/// even bed of energy g per metre has the intensity g c tau_e / 2. Throws std::invalid_argument
/// unless pulse, sound speed and bin are positive.
std::vector<double> pulse_kernel(const Pulse& pulse, double sound_speed_mps, double bin_m);

/// What makes samples a bin apart of white noise that are correlated as the pulse makes speckle:
/// taps[d] weighs the bin d places off, either way. Their squares, both ways, sum to 1.
std::vector<float> speckle_taps(const Pulse& pulse, double sound_speed_mps, double bin_m);

}  // namespace ensonify::engine
