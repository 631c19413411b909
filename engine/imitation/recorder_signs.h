#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include <ensonify/engine/comparison/find_bed.h>
#include <ensonify/engine/imitation/evidence.h>
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
  double burst_m = 0.0;  ///< as OtherPathsOptions::burst_m
  /// An automatic gain makes all ranges equally bright, the water column as well.
  bool even_ranges = false;
  /// The same for the mean of this many samples of each ping; 0: no such gain was found.
  std::size_t even_samples = 0;
  bool has_automatic_gain() const { return even_ranges || even_samples > 0; }
  double column_db = -60.0;  ///< rms of the water column, dB re full scale
  Evidence bits_from, ping_mean_from, curve_from, curve_range_from, looks_from, burst_from,
      column_from;
};
RecorderSigns recorder_signs(const LineWithBed& line);

/// The amplitude before the transfer curve, over full scale; `share` is a sample over full scale.
double expanded(double share, const RecorderSigns& recorder);

/// Standard deviation over mean, and skewness, of what a detector makes of this number of looks
/// with Rayleigh amplitudes, and of its square root if the curve is that. If the curve is
/// logarithmic, the standard deviation in decibels instead, and the skewness of the decibels.
struct Speckle {
  double contrast, skew;
};
Speckle speckle_of(Detector detector, int looks, TransferCurve curve = TransferCurve::linear);

/// The first recorded sample of a ping that is clear of the transmit leakage; `bed` is its first of
/// the bed.
std::size_t column_begin(const RecordedPing& ping, std::size_t bed);

}  // namespace ensonify::engine
