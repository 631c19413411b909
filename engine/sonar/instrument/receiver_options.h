#pragma once

#include <optional>

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
  std::optional<double> gain_db;  ///< full scale over the received amplitude times the varied gain
                                  ///< at 1 m, dB re 1/uPa; unset: automatic
  int looks = 1;  ///< independent echoes a sample is made of
  Detector detector = Detector::mean;
  double ping_mean =
      0.0;  ///< mean amplitude over full scale that each side's ping is scaled to; 0: as it is
  TransferCurve curve = TransferCurve::linear;
  double curve_range_db = 90.0;  ///< of a logarithmic curve: what lies so far below full scale is 0
  int bits = 15;                 ///< 15: what readers of XTF and JSF take
};

}  // namespace ensonify::engine
