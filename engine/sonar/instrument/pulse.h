#pragma once

#include <span>
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
/// gain B T. Its frequency rises.
///
/// A range is the one of the leading edge: the echo of a CW pulse begins at its range and ends half
/// a pulse's way, c T / 2, behind it. A compressed sweep peaks at its range.
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
  /// scaled so that it does not change an echo's peak. It is 1 / length for a CW pulse and for a
  /// sweep (B over the gain B T). For a sweep with a window w it is mean(w^2) / mean(w)^2 times as
  /// much: 1.5 times (1.76 dB) for Hann's.
  double noise_bandwidth_hz() const;
  /// Amplitude over its peak, at a time from the echo's own; a sweep's lobes alternate in sign.
  double amplitude(double time_s) const;
  double intensity(double time_s) const;
  /// Correlation of the amplitudes of fully developed speckle at two times this far apart: the
  /// autocorrelation of the pulse.
  double correlation(double time_s) const;
  /// The times from the echo's own before and behind which the intensity stays below -60 dB.
  double begin_s() const;
  double end_s() const;
  /// The time from the echo's own to the middle of its intensity.
  double middle_s() const { return 0.5 * (begin_s() + end_s()); }
  /// By how much the range of a compressed echo is too small, per m/s of closing speed of sonar and
  /// target: f T / B. The Doppler shift 2 v f / c moves a sweep of the rate B / T by the time -(2 v
  /// f / c) T / B, which is a range of -v f T / B. 0 for a CW pulse.
  double closing_shift_s(double frequency_hz) const;
  /// The range cell, c tau_e / 2.
  double cell_m(double sound_speed_mps) const {
    return 0.5 * sound_speed_mps * effective_length_s();
  }
};

/// How a pulse spreads energy over neighbouring bins: intensity per energy of a bin; both are
/// averages over a bin.
struct PulseKernel {
  int first = 0;  ///< the bin of weights[0]: this many bins farther (negative: nearer)
  std::vector<double> weights;  ///< each weight is for the bin behind that of the weight before it
};

/// The kernel of a pulse. The parts of the pulse below -60 dB are left out. The sum of the weights
/// is cell / bin, so that a uniform bed of energy g per metre has the intensity g c tau_e / 2.
/// Throws std::invalid_argument unless pulse, sound speed and bin are positive.
PulseKernel pulse_kernel(const Pulse& pulse, double sound_speed_mps, double bin_m);

/// Spreads the energy of bins by the kernel. energy: of the first bin of `spread`; as many bins as
/// the kernel has weights must be there before the first and behind the last.
void spread_by_pulse(const PulseKernel& kernel, const double* energy, std::span<double> spread);

/// The filter that gives white noise, sampled once per bin, the correlation of speckle of a pulse.
/// The squares of all its weights sum to 1.
struct SpeckleFilter {
  bool even = false;        ///< taps[d] is also the weight of the bin d bins farther
  std::vector<float> taps;  ///< taps[d] is the weight of the bin d bins nearer
};

/// The filter of a sweep is even. That of a CW pulse is the pulse itself, a box behind the leading
/// edge, if it is a whole number of bins long. Else it is the filter of the same number of taps
/// with the pulse's correlation. So a bin sums as many scatterers as the pulse covers. An even
/// filter with this correlation would not: it gives few of them most of the weight. Pulse, sound
/// speed and bin must be positive.
SpeckleFilter speckle_filter(const Pulse& pulse, double sound_speed_mps, double bin_m);

}  // namespace ensonify::engine
