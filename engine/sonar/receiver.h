#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace ensonify::engine {

/// What of a sample's looks is recorded.
enum class Detector { mean, peak };

/// How the detected amplitude, over full scale, becomes a number between 0 and 1.
enum class TransferCurve { linear, square_root, logarithmic };

/// From the array to the file.
struct ReceiverOptions {
  bool noise = true;                    ///< of the sea and its own
  std::optional<double> self_noise_db;  ///< its own, dB re 1 uPa^2/Hz behind the beam; unset: none
  std::optional<double> output_noise_db;  ///< behind the gain, dB re full scale; unset: none
  double spreading = 40.0;                ///< time-varied gain, dB per factor of ten in range
  bool absorption = true;                 ///< and of the two-way absorption
  std::optional<double>
      gain_db;    ///< full scale over the received amplitude times the varied gain at
                  ///< 1 m, dB re 1/uPa; unset: automatic
  int looks = 1;  ///< independent echoes a sample is made of
  Detector detector = Detector::mean;
  double ping_mean =
      0.0;  ///< mean amplitude over full scale that each side's ping is scaled to; 0: as it is
  TransferCurve curve = TransferCurve::linear;
  double curve_range_db = 90.0;  ///< of a logarithmic curve: what lies so far below full scale is 0
  int bits = 15;                 ///< 15: what readers of XTF and JSF take
};

/// The end of the signal chain: gain, transfer curve, clip, digitiser; and the way back.
class Recorder {
 public:
  /// full_scale_level_db: the received level, dB re 1 uPa^2, that reaches full scale at 1 m where the
  /// options leave the gain to it.
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
