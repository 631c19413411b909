#pragma once

#include <vector>

namespace ensonify::engine {

enum class PulseKind { cw, lfm };
enum class PulseWindow { none, hann };

/// The transmitted pulse, described by its effect on the echoes.
///
/// A CW pulse has the intensity of a box of its length. A linear sweep (LFM) has, after the matched
/// filter, the transform of its flat spectrum: an intensity of sinc^2(B t), whose first side lobe
/// is 13.3 dB down and whose -3 dB width is 0.886 / B. With a Hann window over the spectrum it is
/// (sinc(B t) / (1 - (B t)^2))^2, with 31.5 dB and 1.44 / B. The filter collects the energy of the
/// whole sweep: its length T does not change an echo's level or shape, but lowers the noise by the
/// gain B T.
struct Pulse {
  PulseKind kind = PulseKind::cw;
  double bandwidth_hz = 30e3;
  double length_s = 0.0;                   ///< as transmitted; 0: 1 / bandwidth
  PulseWindow window = PulseWindow::none;  ///< over the spectrum of a sweep

  double transmitted_length_s() const { return length_s > 0.0 ? length_s : 1.0 / bandwidth_hz; }
  /// Energy over peak intensity of what the echoes are formed with: the length of a CW pulse, 1 / B
  /// for a sweep, 1.5 / B with a Hann window.
  double effective_length_s() const;
  /// Power of white noise after the matched filter over its spectral density, with the filter
  /// scaled so that it does not change an echo's peak: 1 / length, for a CW pulse and for a sweep
  /// (B over the gain B T); times mean(w^2) / mean(w)^2 of a sweep's window w, which is 1.5
  /// (1.76 dB) for Hann's.
  double noise_bandwidth_hz() const;
  /// Intensity over its peak, at a time from the middle (either sign).
  double intensity(double time_s) const;
  /// Correlation of the amplitudes of fully developed speckle at two times this far apart: the
  /// autocorrelation of the pulse.
  double correlation(double time_s) const;
  /// The time from the middle beyond which the intensity stays below -60 dB.
  double reach_s() const;
  /// The range cell, c tau_e / 2.
  double cell_m(double sound_speed_mps) const {
    return 0.5 * sound_speed_mps * effective_length_s();
  }
};

/// How a pulse spreads energy over neighbouring bins: kernel[d] is the intensity in a bin per
/// energy in a bin d bins away, on either side; both are averages over a bin. The part beyond the
/// pulse's reach is left out; the kernel, summed over both sides, is scaled to cell / bin, so that
/// a uniform bed of energy g per metre has the intensity g c tau_e / 2. Throws
/// std::invalid_argument unless pulse, sound speed and bin are positive.
std::vector<double> pulse_kernel(const Pulse& pulse, double sound_speed_mps, double bin_m);

/// The symmetric filter that gives white noise, sampled once per bin, the correlation of speckle of
/// this pulse: taps[d] is the weight of a bin d bins away, on either side. Their squares, over both
/// sides, sum to 1.
std::vector<float> speckle_taps(const Pulse& pulse, double sound_speed_mps, double bin_m);

}  // namespace ensonify::engine
