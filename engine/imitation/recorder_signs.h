#pragma once

#include <cstddef>
#include <span>

#include <ensonify/engine/imitation/evidence.h>
#include <ensonify/engine/recording/recorded_line.h>
#include <ensonify/engine/sonar/instrument/receiver_options.h>

namespace ensonify::engine {

/// What the samples of a line show of its recorder, without any simulation.
struct RecorderSigns {
  double full_scale = 1.0;  ///< in the recording's numbers
  int bits = 15;
  bool clips = false;      ///< several samples are at full scale
  double ping_mean = 0.0;  ///< as ReceiverOptions::ping_mean; 0: pings are not scaled
  TransferCurve curve = TransferCurve::linear;
  double curve_range_db = 90.0;
  Detector detector = Detector::mean;
  int looks = 1;
  double burst_m = 0.0;      ///< as OtherPathsOptions::burst_m
  double column_db = -60.0;  ///< rms of the water column, dB re full scale
  Evidence bits_from, ping_mean_from, curve_from, looks_from, burst_from, column_from;
};
RecorderSigns recorder_signs(const RecordedLine& line);

/// Standard deviation over mean, and skewness, of what a detector makes of this number of looks
/// with Rayleigh amplitudes, and of its square root if the curve is that.
struct Speckle {
  double contrast, skew;
};
Speckle speckle_of(Detector detector, int looks, TransferCurve curve = TransferCurve::linear);

/// The amplitude before the transfer curve, over full scale.
double expanded(double share, const RecorderSigns& recorder);

/// The samples of a ping's water column that are recorded and clear of the transmit leakage, where
/// `bed` is its bed_edge().
std::span<const float> water_column(const RecordedLine& line, Side side, std::size_t ping,
                                    std::size_t bed);

}  // namespace ensonify::engine
