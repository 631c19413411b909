#include <ensonify/scatter/sound_speed_profile.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include <fmt/format.h>

namespace ensonify::scatter {
namespace {

constexpr double deepest_sample_m = 12000.0;  // below the deepest trench
constexpr double slowest_mps = 1000.0;
constexpr double fastest_mps = 2000.0;
constexpr double one_depth_m = 1e-3;       // closer samples have one depth; casts resolve no less
constexpr double contradiction_mps = 2.0;  // more than the errors of a probe

double speed_in(const SoundSpeedLayer& layer, double depth_m) {
  if (layer.gradient_per_s == 0.0) return layer.top_mps;
  return std::lerp(layer.top_mps, layer.bottom_mps,
                   (depth_m - layer.top_m) / (layer.bottom_m - layer.top_m));
}

/// Travel time straight down between two depths in one layer: the integral of dz / c(z).
double time_s(const SoundSpeedLayer& layer, double from_m, double to_m) {
  const double speed = speed_in(layer, from_m);
  const double change = layer.gradient_per_s * (to_m - from_m) / speed;
  return (to_m - from_m) / speed * (change == 0.0 ? 1.0 : std::log1p(change) / change);
}

using AbsorptionLaw = std::function<double(double depth_m, double sound_speed_mps)>;

/// Between two samples the sound speed is linear in depth, but the absorption need not be, and a
/// cast may have few rows. Adds samples between a and b until the absorption is nearly linear, too.
void add_between(const SoundSpeedSample& a, const SoundSpeedSample& b,
                 const AbsorptionLaw& db_per_m, std::vector<SoundSpeedSample>& samples) {
  constexpr double bend = 1e-3, thinnest_m = 0.1;
  if (b.depth_m - a.depth_m < thinnest_m) return;
  SoundSpeedSample middle{std::midpoint(a.depth_m, b.depth_m),
                          std::midpoint(a.sound_speed_mps, b.sound_speed_mps)};
  middle.absorption_db_per_m = db_per_m(middle.depth_m, middle.sound_speed_mps);
  const double linear = std::midpoint(a.absorption_db_per_m, b.absorption_db_per_m);
  if (std::abs(middle.absorption_db_per_m - linear) <= bend * linear) return;
  add_between(a, middle, db_per_m, samples);
  samples.push_back(middle);
  add_between(middle, b, db_per_m, samples);
}

}  // namespace

void check_sound_speed_sample(const SoundSpeedSample& sample) {
  if (!(sample.depth_m >= 0.0 && sample.depth_m <= deepest_sample_m))
    throw std::invalid_argument(
        fmt::format("the depth is {} m, expected 0 (the surface) to {}, counted downwards",
                    sample.depth_m, deepest_sample_m));
  if (!(sample.sound_speed_mps >= slowest_mps && sample.sound_speed_mps <= fastest_mps))
    throw std::invalid_argument(fmt::format("the sound speed is {} m/s, expected {} to {}",
                                            sample.sound_speed_mps, slowest_mps, fastest_mps));
}

SoundSpeedProfile::SoundSpeedProfile(std::vector<SoundSpeedSample> samples) {
  if (samples.empty())
    throw std::invalid_argument("a sound speed profile needs at least one sample");
  for (const SoundSpeedSample& sample : samples) check_sound_speed_sample(sample);
  sorted_ = std::ranges::is_sorted(samples, {}, &SoundSpeedSample::depth_m) ||
            std::ranges::is_sorted(samples, std::greater(), &SoundSpeedSample::depth_m);
  // Samples at one depth are sorted by speed, so that the order of the given samples does not
  // change the last bits of the means.
  std::ranges::sort(samples, [](const SoundSpeedSample& a, const SoundSpeedSample& b) {
    return a.depth_m != b.depth_m ? a.depth_m < b.depth_m : a.sound_speed_mps < b.sound_speed_mps;
  });

  constexpr double inf = std::numeric_limits<double>::infinity();
  layers_.reserve(samples.size() + 1);
  for (auto sample = samples.begin(); sample != samples.end();) {
    const double depth_m = sample->depth_m;
    double sum_mps = 0.0, sum_db_per_m = 0.0;
    double slowest = sample->sound_speed_mps, fastest = slowest;
    int count = 0;
    for (; sample != samples.end() && sample->depth_m - depth_m < one_depth_m; ++sample, ++count) {
      sum_mps += sample->sound_speed_mps;
      sum_db_per_m += sample->absorption_db_per_m;
      slowest = std::min(slowest, sample->sound_speed_mps);
      fastest = std::max(fastest, sample->sound_speed_mps);
    }
    if (fastest - slowest > widest_.spread_mps) widest_ = {depth_m, fastest - slowest};
    const double speed_mps = sum_mps / count, db_per_m = sum_db_per_m / count;
    if (layers_.empty()) {
      layers_.push_back({-inf, depth_m, speed_mps, speed_mps, 0.0, db_per_m});
      absorbed_db_.assign(2, 0.0);
    } else {
      SoundSpeedLayer& above = layers_.back();
      above.bottom_m = depth_m;
      above.bottom_mps = speed_mps;
      const double thick_m = depth_m - above.top_m;
      above.gradient_per_s = (speed_mps - above.top_mps) / thick_m;
      above.db_per_m2 = (db_per_m - above.top_db_per_m) / thick_m;
      absorbed_db_.push_back(absorbed_db_.back() + 0.5 * thick_m * (above.top_db_per_m + db_per_m));
    }
    layers_.push_back({depth_m, inf, speed_mps, speed_mps, 0.0, db_per_m});
  }
}

std::size_t SoundSpeedProfile::layer_index(double depth_m) const {
  const auto below = std::ranges::upper_bound(layers_, depth_m, {}, &SoundSpeedLayer::top_m);
  return static_cast<std::size_t>(std::max<std::ptrdiff_t>(below - layers_.begin() - 1, 0));
}

double SoundSpeedProfile::speed_mps(double depth_m) const {
  return speed_in(layers_[layer_index(depth_m)], depth_m);
}

SoundSpeedProfile SoundSpeedProfile::with_absorption(
    const std::function<double(double, double)>& db_per_m) const {
  std::vector<SoundSpeedSample> samples;
  for (const SoundSpeedLayer& layer : layers_) {
    if (std::isinf(layer.top_m)) continue;
    const SoundSpeedSample sample{layer.top_m, layer.top_mps, db_per_m(layer.top_m, layer.top_mps)};
    if (!samples.empty()) add_between(SoundSpeedSample(samples.back()), sample, db_per_m, samples);
    samples.push_back(sample);
  }
  SoundSpeedProfile profile(std::move(samples));
  profile.sorted_ = sorted_;
  profile.widest_ = widest_;
  return profile;
}

/// Absorption in dB on the path straight down from the first sample to a depth.
double SoundSpeedProfile::absorbed_db(double depth_m) const {
  const std::size_t i = layer_index(depth_m);
  const double top_m = i == 0 ? shallowest_m() : layers_[i].top_m;
  const double middle_m = 0.5 * (top_m + depth_m);
  return absorbed_db_[i] + (depth_m - top_m) * layers_[i].absorption_db_per_m(middle_m);
}

double SoundSpeedProfile::mean_absorption_db_per_m(double from_m, double to_m) const {
  if (std::abs(to_m - from_m) < one_depth_m)
    return layers_[layer_index(from_m)].absorption_db_per_m(from_m);
  return (absorbed_db(to_m) - absorbed_db(from_m)) / (to_m - from_m);
}

double SoundSpeedProfile::mean_speed_mps(double from_m, double to_m) const {
  if (!std::isfinite(from_m) || !std::isfinite(to_m))
    throw std::invalid_argument("a mean sound speed needs two finite depths");
  const auto [upper_m, lower_m] = std::minmax(from_m, to_m);
  if (upper_m == lower_m) return speed_mps(upper_m);
  double sum_s = 0.0;
  for (std::size_t i = layer_index(upper_m); i < layers_.size() && layers_[i].top_m < lower_m; ++i)
    sum_s += time_s(layers_[i], std::max(upper_m, layers_[i].top_m),
                    std::min(lower_m, layers_[i].bottom_m));
  return (lower_m - upper_m) / sum_s;
}

std::vector<std::string> SoundSpeedProfile::remarks(double upper_m, double lower_m) const {
  std::vector<std::string> said;
  if (shallowest_m() == deepest_m()) {
    said.push_back(fmt::format("the cast is one sample, at {:.1f} m; its speed is used everywhere",
                               deepest_m()));
  } else {
    if (upper_m < shallowest_m())
      said.push_back(fmt::format(
          "the cast starts at {:.1f} m, and {:.1f} m is reached; its first speed is used above",
          shallowest_m(), upper_m));
    if (lower_m > deepest_m())
      said.push_back(fmt::format(
          "the cast ends at {:.1f} m, and {:.1f} m is reached; its last speed is used below",
          deepest_m(), lower_m));
  }
  if (!sorted_) said.emplace_back("the cast's samples are not in order of depth; they were sorted");
  if (widest_.spread_mps > contradiction_mps)
    said.push_back(fmt::format(
        "the cast's samples at {:.1f} m differ by {:.1f} m/s; their mean is used; check the file",
        widest_.depth_m, widest_.spread_mps));
  return said;
}

}  // namespace ensonify::scatter
