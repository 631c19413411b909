#include <ensonify/engine/sonar/echo/steady_field.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace ensonify::engine {

SteadyField::SteadyField(const Pulse& pulse, double sound_speed_mps, double bin_m, std::size_t bins)
    : pulse_(pulse), bin_m_(bin_m), bin_s_(2.0 * bin_m / sound_speed_mps), bins_(bins) {
  constexpr double samples_per_lobe = 4.0;    // of a sweep, per 1 / B
  constexpr double most_lobes_in_bin = 16.0;  // in bins with more, another sweep is sampled
  if (!(bin_m > 0.0 && sound_speed_mps > 0.0 && pulse.effective_length_s() > 0.0))
    throw std::invalid_argument("SteadyField: the pulse, its speed and the bin must be positive");
  if (pulse.kind == PulseKind::cw) return;
  pulse_.bandwidth_hz = std::min(pulse.bandwidth_hz, most_lobes_in_bin / bin_s_);
  scale_ = std::sqrt(pulse_.bandwidth_hz / pulse.bandwidth_hz);
  samples_per_bin_ =
      static_cast<std::size_t>(std::ceil(samples_per_lobe * bin_s_ * pulse_.bandwidth_hz));
}

void SteadyField::add(double range_m, std::complex<double> amplitude) {
  empty_ = false;
  if (pulse_.kind == PulseKind::cw) {
    const double begin = range_m / bin_m_;
    edges_.push_back({begin, amplitude, 1});
    edges_.push_back({begin + pulse_.end_s() / bin_s_, -amplitude, -1});
    return;
  }
  samples_.resize(bins_.size() * samples_per_bin_);
  const double step_s = bin_s_ / static_cast<double>(samples_per_bin_);
  const double peak = range_m / bin_m_ * static_cast<double>(samples_per_bin_) - 0.5;
  const double reach = pulse_.end_s() / step_s, count = static_cast<double>(samples_.size());
  const auto first = static_cast<std::size_t>(std::clamp(std::ceil(peak - reach), 0.0, count));
  const auto end = static_cast<std::size_t>(std::clamp(std::ceil(peak + reach), 0.0, count));
  for (std::size_t i = first; i < end; ++i)
    samples_[i] += scale_ * amplitude * pulse_.amplitude((static_cast<double>(i) - peak) * step_s);
}

/// Goes from edge to edge, through the bins between them.
void SteadyField::sum_tones() {
  std::ranges::sort(edges_, {}, &Edge::place);
  const auto count = static_cast<double>(bins_.size());
  std::complex<double> field = 0.0;
  int echoes = 0;
  double from = 0.0;
  for (const Edge& edge : edges_) {
    const double until = std::clamp(edge.place, 0.0, count);
    while (echoes > 0 && from < until) {
      const double bin = std::floor(from), end = std::min(bin + 1.0, until);
      Bin& sum = bins_[static_cast<std::size_t>(bin)];
      sum.intensity += (end - from) * std::norm(field);
      sum.field += (end - from) * field;
      from = end;
    }
    from = until;
    echoes += edge.echoes;
    field += edge.change;
    if (echoes == 0) field = 0.0;  // removes what rounding left
  }
}

void SteadyField::sum_samples() {
  const double share = 1.0 / static_cast<double>(samples_per_bin_);
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    Bin& sum = bins_[i / samples_per_bin_];
    sum.intensity += share * std::norm(samples_[i]);
    sum.field += share * samples_[i];
  }
}

void SteadyField::write(std::vector<float>& re, std::vector<float>& im) {
  re.clear();
  im.clear();
  if (empty_) return;
  if (pulse_.kind == PulseKind::cw)
    sum_tones();
  else
    sum_samples();
  for (Bin& bin : bins_) {
    const double size = std::abs(bin.field), amplitude = std::sqrt(bin.intensity);
    const std::complex<double> phase = size > 0.0 ? bin.field / size : 1.0;
    re.push_back(static_cast<float>(amplitude * phase.real()));
    im.push_back(static_cast<float>(amplitude * phase.imag()));
    bin = {};
  }
  edges_.clear();
  std::ranges::fill(samples_, 0.0);
  empty_ = true;
}

}  // namespace ensonify::engine
