#include <ensonify/engine/sonar/reception/recorder.h>

#include <algorithm>
#include <cmath>

#include <ensonify/engine/sonar/reception/signal_kernel.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {

FullScale FullScale::of(std::span<const float> gains) {
  const auto level_db = [](double gain) { return -scatter::to_db(gain * gain); };
  return {level_db(gains.front()), level_db(gains.back())};
}

Recorder::Recorder(const ReceiverOptions& options, double bin_m, int bins,
                   double absorption_db_per_m, double automatic_gain_db, double noise)
    : curve_(options.curve),
      curve_range_db_(static_cast<float>(options.curve_range_db)),
      full_scale_((1u << options.bits) - 1u) {
  // The gain lies between plus and minus this. It is more than any recorder has, and the square of
  // the gain is finite, also after a gain step. Without this limit, the automatic gain would be
  // infinite if absorption leaves nothing of the bed.
  constexpr double max_gain_db = 300.0;
  // A gain that the options set is not reduced, even if the noise then exceeds the limit.
  double loudest_db = max_gain_db;
  if (noise > 0.0)
    loudest_db = std::max(options.bed_level_db - scatter::to_db(noise),
                          options.gain_db.value_or(-max_gain_db));
  for (int bin = 0; bin < bins; ++bin) {
    const double r = std::max(bin + 0.5, 1.0) * bin_m;
    double gain_db = options.gain_db.value_or(automatic_gain_db);
    gain_db += options.spreading * std::log10(r);
    if (options.absorption) gain_db += 2.0 * absorption_db_per_m * r;
    if (gain_db > loudest_db) {
      gain_db = loudest_db;
      if (gain_ends_m_ == 0.0) gain_ends_m_ = r;
    }
    gain_db = std::clamp(gain_db, -max_gain_db, max_gain_db);
    gains_.push_back(static_cast<float>(scatter::amplitude_from_db(gain_db)));
  }
}

std::uint32_t Recorder::sample(float amplitude) const {
  std::uint32_t one;
  samples({&amplitude, 1}, 1.0f, {&one, 1});
  return one;
}

void Recorder::samples(std::span<const float> amplitudes, float gain,
                       std::span<std::uint32_t> samples) const {
  digitise({.bins = samples.size(),
            .amplitude = amplitudes.data(),
            .gain = gain,
            .square_root = curve_ == TransferCurve::square_root,
            .curve_range_db = curve_ == TransferCurve::logarithmic ? curve_range_db_ : 0.0,
            .full_scale = static_cast<double>(full_scale_),
            .samples = samples.data()});
}

double Recorder::amplitude(std::uint32_t sample) const {
  const double fraction = static_cast<double>(sample) / full_scale_;
  switch (curve_) {
    case TransferCurve::linear: break;
    case TransferCurve::square_root: return fraction * fraction;
    case TransferCurve::logarithmic:
      return sample > 0 ? scatter::amplitude_from_db((fraction - 1.0) * curve_range_db_) : 0.0;
  }
  return fraction;
}

}  // namespace ensonify::engine
