#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/engine/sonar/instrument/receiver_options.h>

namespace ensonify::engine {

/// The received level at full scale in the nearest and in the farthest bin, dB re 1 uPa.
struct FullScale {
  double near_db = 0.0, far_db = 0.0;
  /// From gains by bin, as Recorder::gains().
  static FullScale of(std::span<const float> gains);
};

/// The last stages of the signal chain: gain, transfer curve, clipping, digitiser; and the inverse
/// of these.
class Recorder {
 public:
  /// automatic_gain_db: the gain at 1 m, dB re 1/uPa, that is used if the options set none. noise:
  /// expected power of the noise, uPa^2. The time-varied gain ends where noise would be recorded
  /// above the options' bed_level_db.
  Recorder(const ReceiverOptions& options, double bin_m, int bins, double absorption_db_per_m,
           double automatic_gain_db, double noise = 0.0);

  /// The range from which on the gain stays the same because of noise; 0: none.
  double gain_ends_m() const { return gain_ends_m_; }

  /// In a bin: recorded amplitude, divided by full scale, per received amplitude (uPa). Amplitudes
  /// above 1 are clipped.
  float gain(std::size_t bin) const { return gains_[bin]; }
  std::span<const float> gains() const { return gains_; }
  /// The sample for an amplitude that is divided by full scale.
  std::uint32_t sample(float amplitude) const;
  /// The samples for such amplitudes, each multiplied by `gain` first. Both spans have the same
  /// length.
  void samples(std::span<const float> amplitudes, float gain,
               std::span<std::uint32_t> samples) const;
  /// The inverse of sample().
  double amplitude(std::uint32_t sample) const;
  std::uint32_t full_scale() const { return full_scale_; }

 private:
  TransferCurve curve_;
  float curve_range_db_;
  std::uint32_t full_scale_;
  double gain_ends_m_ = 0.0;
  std::vector<float> gains_;
};

}  // namespace ensonify::engine
