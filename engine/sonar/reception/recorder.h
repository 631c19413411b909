#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/engine/sonar/instrument/receiver_options.h>

namespace ensonify::engine {

/// The end of the signal chain: gain, transfer curve, clip, digitiser; and the way back.
class Recorder {
 public:
  /// full_scale_level_db: the received level, dB re 1 uPa^2, that reaches full scale at 1 m where
  /// the options leave the gain to it.
  Recorder(const ReceiverOptions& options, double bin_m, int bins, double absorption_db_per_m,
           double automatic_gain_db);

  /// Amplitude over full scale from received amplitude (uPa) in a bin; what is above 1 clips.
  float gain(std::size_t bin) const { return gains_[bin]; }
  std::span<const float> gains() const { return gains_; }
  /// Of an amplitude over full scale.
  std::uint32_t sample(float amplitude) const;
  /// Of as many, each times a gain.
  void samples(std::span<const float> amplitudes, float gain,
               std::span<std::uint32_t> samples) const;
  /// The amplitude over full scale that a sample stands for.
  double amplitude(std::uint32_t sample) const;
  std::uint32_t full_scale() const { return full_scale_; }

 private:
  TransferCurve curve_;
  float curve_range_db_;
  std::uint32_t full_scale_;
  std::vector<float> gains_;
};

}  // namespace ensonify::engine
