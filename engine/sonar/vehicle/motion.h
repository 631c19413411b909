#pragma once

#include <cstdint>
#include <vector>

#include <ensonify/engine/sonar/vehicle/motion_options.h>
#include <ensonify/engine/sonar/vehicle/track.h>

namespace ensonify::engine {

/// A stationary random function of time with zero mean, the sum of the two bands of an Oscillation.
///
/// Each has a spectrum of Gaussian form over angular frequency, about w0 with half width s: the
/// periodic one w0 = 2 pi / period and s = 0.15 w0, as swell is described (Goda, Random Seas and
/// Design of Maritime Structures); the slow one w0 = 0 and s = 1 / wander_s. The correlation over a
/// lag u is rms^2 exp(-s^2 u^2 / 2) cos(w0 u). It is made as sum_k a_k cos(w_k t + p_k) with random
/// phases (Shinozuka and Deodatis, Appl. Mech. Rev. 44, 191, 1991, eq. 31), a harmonic in each of
/// 64 strips over +-4 s, a_k^2 / 2 being the strip's share of the variance; the frequency is
/// anywhere in its strip, so that nothing repeats. It is smooth, and rate and integral are exact.
class Oscillator {
 public:
  Oscillator() = default;  ///< does not move
  /// `number` tells the degrees of freedom apart. Throws std::invalid_argument for a negative rms
  /// or a time that is not positive.
  Oscillator(const Oscillation& oscillation, std::uint64_t seed, std::uint64_t number);

  double at(double t_s) const;
  double rate(double t_s) const;
  double integral(double t_s) const;  ///< from time 0

 private:
  struct Harmonic {
    double amplitude, radps, phase_rad;
  };
  void add_band(double rms, double centre_radps, double half_width_radps, std::uint64_t seed,
                std::uint64_t number, std::uint64_t band);
  std::vector<Harmonic> harmonics_;
};

/// The movements of a vehicle: functions of time alone, so that any ping is the same whoever asks.
class Motion {
 public:
  Motion(const MotionOptions& options, std::uint64_t seed);
  /// The change of a generated track's speed.
  const Oscillator& speed() const { return speed_; }
  /// A track's pose, whose heading is its course, as the vehicle has it at that time; with its
  /// rates.
  Pose applied_to(const Pose& track) const;

 private:
  MotionOptions options_;
  Oscillator roll_, pitch_, heading_, heave_, sway_, surge_, speed_;
};

}  // namespace ensonify::engine
