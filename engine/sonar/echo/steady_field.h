#pragma once

#include <complex>
#include <cstddef>
#include <vector>

#include <ensonify/engine/sonar/instrument/pulse.h>

namespace ensonify::engine {

/// The sum of steady echoes, with their phases, over the bins of a line: engine/sonar/README.md,
/// "Glints that overlap in time". Echoes with the complex amplitudes a_i at the times t_i have the
/// field s(t) = sum of a_i p(t - t_i), with the amplitude p of the pulse. The intensity in a bin is
/// the mean of |s|^2 over its time.
///
/// The field of a tone is constant between the beginnings and ends of its echoes: the mean over a
/// bin is a sum over these intervals, and exact. The field of a sweep has the bandwidth B. It is
/// sampled at least four times per 1 / B. So the sum of |s|^2 over all samples is its energy
/// (Parseval), and the error of a bin's mean is within 2 % of the brightest bin. In bins longer
/// than 16 / B, a sweep with the bandwidth of 16 per bin and the same energy stands for the sweep.
class SteadyField {
 public:
  /// Throws std::invalid_argument unless pulse, sound speed and bin are positive.
  SteadyField(const Pulse& pulse, double sound_speed_mps, double bin_m, std::size_t bins);

  /// Adds an echo. range_m: where the echo of a tone begins, or the echo of a sweep peaks.
  void add(double range_m, std::complex<double> amplitude);
  /// Writes one field value per bin, or none if there is no echo; then forgets the echoes and keeps
  /// the memory. The square of the value is the mean intensity in the bin. Its phase is the phase
  /// of the mean field.
  void write(std::vector<float>& re, std::vector<float>& im);

 private:
  struct Bin {
    double intensity = 0.0;
    std::complex<double> field;
  };
  struct Edge {    // of a tone's echo
    double place;  // in bins
    std::complex<double> change;
    int echoes;  // number that begin here, minus the number that end here
  };
  void sum_tones();
  void sum_samples();

  Pulse pulse_;
  double bin_m_, bin_s_;
  std::vector<Bin> bins_;
  bool empty_ = true;
  // Of a tone:
  std::vector<Edge> edges_;
  // Of a sweep:
  double scale_ = 1.0;  // of the amplitudes
  std::size_t samples_per_bin_ = 1;
  std::vector<std::complex<double>> samples_;
};

}  // namespace ensonify::engine
