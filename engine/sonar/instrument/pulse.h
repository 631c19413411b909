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
/// is 13.3 dB down and whose -3 dB width is 0.886 / B. With a Hann window over the spectrum the
/// intensity is (sinc(B t) / (1 - (B t)^2))^2, whose first side lobe is 31.5 dB down and whose -3
/// dB width is 1.44 / B. The filter collects the energy of the whole sweep: its length T does not
/// change an echo's level or shape, but lowers the noise by the gain B T. The frequency of the
/// sweep rises.
///
/// The range of an echo belongs to the leading edge of the pulse: the echo of a CW pulse begins at
/// its range and ends c T / 2 farther. The echo of a compressed sweep peaks at its range.
struct Pulse {
  PulseKind kind = PulseKind::cw;
  double bandwidth_hz = 30e3;
  double length_s = 0.0;                   ///< as transmitted; 0: 1 / bandwidth
  PulseWindow window = PulseWindow::none;  ///< over the spectrum of a sweep

  double transmitted_length_s() const { return length_s > 0.0 ? length_s : 1.0 / bandwidth_hz; }
  /// Energy divided by peak intensity of the pulse after the matched filter: the length of a CW
  /// pulse, 1 / B for a sweep, 1.5 / B with a Hann window.
  double effective_length_s() const;
  /// Power of white noise after the matched filter, divided by the noise's spectral density, if the
  /// filter does not change an echo's peak. It is 1 / length for a CW pulse and for a sweep (B
  /// divided by the gain B T). For a sweep with a window w it is mean(w^2) / mean(w)^2 times as
  /// much: 1.5 times (1.76 dB) for Hann's.
  double noise_bandwidth_hz() const;
  /// Amplitude divided by its peak, `time_s` after the time of the echo. The lobes of a sweep
  /// alternate in sign.
  double amplitude(double time_s) const;
  double intensity(double time_s) const;
  /// Correlation of the amplitudes of fully developed speckle at two times this far apart: the
  /// autocorrelation of the pulse.
  double correlation(double time_s) const;
  /// The times before and after which the intensity stays below -60 dB, from the time of the echo.
  double begin_s() const;
  double end_s() const;
  /// The middle of these times.
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

/// How a pulse spreads the energy of a bin over neighbouring bins: their intensity per energy. Both
/// are averages over a bin.
struct PulseKernel {
  int first = 0;  ///< weights[0] is for the bin that is this many bins farther (negative: nearer)
  std::vector<double> weights;  ///< for this bin and the bins that follow
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

/// The filter of a sweep is even. The filter of a CW pulse has one side only. If the pulse is a
/// whole number of bins long, the filter is the pulse itself: a box that begins at the leading
/// edge. If the pulse is longer than 64 bins, the filter is a box of the nearest whole number of
/// bins. Otherwise its number of taps is the pulse's length in bins, rounded up, and its
/// autocorrelation is that of the pulse. So a bin sums as many scatterers as the pulse covers. An
/// even filter with this autocorrelation would give most of the weight to few scatterers. Pulse,
/// sound speed and bin must be positive.
SpeckleFilter speckle_filter(const Pulse& pulse, double sound_speed_mps, double bin_m);

}  // namespace ensonify::engine
