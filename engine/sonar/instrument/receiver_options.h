#pragma once

#include <optional>

namespace ensonify::engine {

/// Which value of a sample's looks is recorded.
enum class Detector { mean, peak };

/// The curve that turns the detected amplitude, divided by full scale, into a number between 0 and
/// 1.
enum class TransferCurve { linear, square_root, logarithmic };

/// The receiver, from the array to the file.
struct ReceiverOptions {
  bool noise = true;  ///< whether there is ambient noise and self-noise
  /// Noise of the receiver and of its platform, dB re 1 uPa^2/Hz after beamforming; unset: none.
  std::optional<double> self_noise_db;
  double self_noise_speed_mps = 2.0;  ///< up to this speed of the vehicle, self_noise_db holds
  double self_noise_slope_db = 60.0;  ///< growth above that speed, dB per factor of ten in speed

  /// The self-noise at a speed, uPa^2/Hz; 0 if there is none.
  double self_noise_density(double speed_mps) const;
  std::optional<double> output_noise_db;  ///< added after the gain, dB re full scale; unset: none
  double output_noise_wander_db = 0.0;    ///< rms change of that noise's level along the line
  double output_noise_wander_s = 7.0;     ///< correlation time of that change
  /// Time-varied gain, dB per factor of ten in range. It ends where the expected noise is recorded
  /// at bed_level_db.
  double spreading = 40.0;
  bool absorption = true;  ///< whether the time-varied gain corrects the two-way absorption too
  /// Gain without the time-varied gain: recorded amplitude, divided by full scale, per received
  /// amplitude at 1 m, dB re 1/uPa. Unset: automatic.
  std::optional<double> gain_db;
  double ping_gain_db = 0.0;  ///< rms change of the gain from ping to ping
  /// Level re full scale at which an automatic gain records the nominal bed at half the range, or,
  /// with steered beams, where it is loudest.
  double bed_level_db = -16.0;
  int looks = 1;  ///< independent echoes per sample
  Detector detector = Detector::mean;
  /// Mean amplitude, divided by full scale, to which each side of a ping is scaled; 0: not scaled.
  double ping_mean = 0.0;
  TransferCurve curve = TransferCurve::linear;
  double curve_range_db = 90.0;  ///< a logarithmic curve gives 0 this far below full scale
  int bits = 15;                 ///< 15: what readers of XTF and JSF accept
};

}  // namespace ensonify::engine
