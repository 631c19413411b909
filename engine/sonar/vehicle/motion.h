#pragma once

#include <cstdint>
#include <vector>

#include <ensonify/engine/sonar/vehicle/track.h>

namespace ensonify::engine {

/// The random movement of one degree of freedom about its mean: a part driven by waves, a slow
/// wander, or both. In the unit of the degree of freedom: radians, metres or m/s.
struct Oscillation {
  double rms = 0.0;  ///< of the periodic part
  double period_s = 8.0;
  double wander_rms = 0.0;  ///< of the slow part
  double wander_s = 60.0;   ///< its correlation time

  bool still() const { return rms == 0.0 && wander_rms == 0.0; }
};

/// The vehicle's deviation from its track: a constant attitude and random movements.
struct MotionOptions {
  double roll_rad = 0.0, pitch_rad = 0.0;  ///< added to those of the track
  double crab_rad = 0.0;                   ///< heading minus course, to starboard
  Oscillation roll, pitch, heading;        ///< radians
  Oscillation heave, sway, surge;          ///< metres: up, to starboard and ahead of the course
  Oscillation speed;                       ///< m/s, only of a generated track
};

/// A stationary random function of time with zero mean, the sum of the two bands of an Oscillation.
///
/// Each band has a Gaussian spectrum over angular frequency with the centre w0 and the half width
/// s. The periodic band has w0 = 2 pi / period and s = 0.15 w0, as swell is described (Goda, Random
/// Seas and Design of Maritime Structures); the slow band has w0 = 0 and s = 1 / wander_s. The
/// correlation over a lag u is rms^2 exp(-s^2 u^2 / 2) cos(w0 u). The function is sum_k a_k cos(w_k
/// t + p_k) with random phases (Shinozuka and Deodatis, Appl. Mech. Rev. 44, 191, 1991, eq. 31):
/// one harmonic in each of 64 strips over +-4 s, where a_k^2 / 2 is the strip's share of the
/// variance. The frequency is random within its strip, so the function does not repeat. It is
/// smooth, and its rate and integral are exact.
class Oscillator {
 public:
  Oscillator() = default;  ///< always 0
  /// `number` is that of the degree of freedom; each number has its own random stream. Throws
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
  /// The pose and rates of the vehicle for a pose of the track, whose heading is the course.
  Pose applied_to(const Pose& track) const;

 private:
  MotionOptions options_;
  Oscillator roll_, pitch_, heading_, heave_, sway_, surge_, speed_;
};

}  // namespace ensonify::engine
