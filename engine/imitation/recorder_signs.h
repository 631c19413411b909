#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include <ensonify/engine/comparison/find_bed.h>
#include <ensonify/engine/imitation/evidence.h>
#include <ensonify/engine/sonar/instrument/receiver_options.h>

namespace ensonify::engine {

/// What the samples of a line show of its recorder. Nothing is simulated.
struct RecorderSigns {
  double full_scale = 1.0;  ///< in the unit of the recording's samples
  int bits = 15;
  bool clips = false;      ///< several samples are at full scale
  double ping_mean = 0.0;  ///< as ReceiverOptions::ping_mean; 0: pings are not scaled
  TransferCurve curve = TransferCurve::linear;
  double curve_range_db = 90.0;
  Detector detector = Detector::mean;
  int looks = 1;
  double burst_m = 0.0;  ///< as OtherPathsOptions::burst_m
  /// Whether an automatic gain makes all ranges equally bright, the water column too.
  bool even_ranges = false;
  /// An automatic gain makes the means of this number of neighbouring samples of a ping equal; 0:
  /// no such gain was found.
  std::size_t even_samples = 0;
  bool has_automatic_gain() const { return even_ranges || even_samples > 0; }
  double column_db = -60.0;  ///< level (rms) of the water column, dB re full scale
  Evidence bits_from, ping_mean_from, curve_from, curve_range_from, looks_from, burst_from,
      column_from;
};
RecorderSigns recorder_signs(const LineWithBed& line);

/// The amplitude before the transfer curve for a sample; both are shares of full scale.
double expanded(double share, const RecorderSigns& recorder);

/// The contrast (standard deviation divided by mean) and the skewness of a detector's output for
/// this number of looks with Rayleigh amplitudes; with a square-root curve, of its square root.
/// With a logarithmic curve: standard deviation and skewness of the decibels.
struct Speckle {
  double contrast, skew;
};
Speckle speckle_of(Detector detector, int looks, TransferCurve curve = TransferCurve::linear);

/// The first recorded sample of a ping after the transmit leakage; `bed` is its first bed sample.
std::size_t column_begin(const RecordedPing& ping, std::size_t bed);

}  // namespace ensonify::engine
