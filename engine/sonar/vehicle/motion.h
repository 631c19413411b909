#pragma once

#include <cstdint>
#include <vector>

#include <ensonify/engine/sonar/vehicle/motion_options.h>
#include <ensonify/engine/sonar/vehicle/track.h>

namespace ensonify::engine {

/// A stationary random function of time with zero mean, the sum of the two bands of an Oscillation.
///
/// Each band has a Gaussian spectrum over angular frequency with the centre w0 and the half width
/// s, both in rad/s. The periodic band has w0 = 2 pi / period and s = 0.15 w0, like swell (Goda,
/// Random Seas and Design of Maritime Structures); the slow band has w0 = 0 and s = 1 / wander_s.
/// The correlation over a lag u is rms^2 exp(-s^2 u^2 / 2) cos(w0 u). The function is sum_k a_k
/// cos(w_k t + p_k) with random phases (Shinozuka and Deodatis, Appl. Mech. Rev. 44, 191, 1991, eq.
/// 31): one harmonic in each of 64 strips from w0 - 4 s to w0 + 4 s, where a_k^2 / 2 is the strip's
/// share of the variance. The frequency is random within its strip, so the function does not
/// repeat. The function is smooth, and rate() and integral() are exact.
class Oscillator {
 public:
  Oscillator() = default;  ///< always 0
  /// `number` identifies the degree of freedom: each number has a separate random stream. Throws
  /// std::invalid_argument for a negative rms or a time that is not positive.
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

/// The movements of a vehicle. They are functions of time alone, so pings can be computed in any
/// order.
class Motion {
 public:
  Motion(const MotionOptions& options, std::uint64_t seed);
  /// The variation of a generated track's speed.
  const Oscillator& speed() const { return speed_; }
  /// The pose and rates of the vehicle for a pose of the track. The heading of the track's pose is
  /// the course.
  Pose applied_to(const Pose& track) const;

 private:
  MotionOptions options_;
  Oscillator roll_, pitch_, heading_, heave_, sway_, surge_, speed_;
};

}  // namespace ensonify::engine
