#include <ensonify/engine/sonar/reception/textured_ground.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include <ensonify/engine/base/made_once.h>
#include <ensonify/engine/base/random.h>
#include <ensonify/engine/sonar/reception/signal_kernel.h>

namespace ensonify::engine {
namespace {

using scatter::GammaTable, scatter::GroundTexture;

constexpr double units_per_patch = 1 << patch_bits;
constexpr std::size_t angles = 90;  // of the tables, one per degree
constexpr double shortest_m = 1.0;  // scale of the slow variation
// For along_rows(): if scatterers are nearer to each other than an eighth of a patch, there is
// nothing to add.
constexpr int nearest_rows = 3 * GammaTable::rows_per_octave, parts_of_row = 4;

// Strengths of mean 1 that vary less than a gamma distribution of the shape 2^6 count as even; that
// changes <I^2> by less than one part in 64.
constexpr int even_log2 = 6;
constexpr float even_patch_row =
    (even_log2 - GammaTable::lowest_log2) * GammaTable::rows_per_octave;

/// The row of GammaTable for a shape, not rounded.
float row_of(double shape) {
  const double log2_shape = std::clamp(std::log2(shape), -1e3, 1e3);
  return static_cast<float>((log2_shape - GammaTable::lowest_log2) * GammaTable::rows_per_octave);
}
std::uint32_t beginning_of(float row) {
  return static_cast<std::uint32_t>(std::max(row + 0.5f, 0.0f)) * GammaTable::columns;
}

/// Ratio of a sum to its integral, for samples along a line that are `step` patches apart: the step
/// times the sum, over all integers k, of 1 - |k| step where this is positive. The integral is 1.
double sum_over_integral(double step) {
  const double k = std::floor(1.0 / step);
  return step * (2.0 * k + 1.0 - step * k * (k + 1.0));
}

/// How much of a patch's variance is left in a weighted sum of samples.
class VarianceLeft {
 public:
  explicit VarianceLeft(const TexturedGround::RangeWeights& of) : step_m_(of.step_m) {
    const std::vector<double>& weights = of.weights;
    const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
    for (std::size_t apart = 0; apart < weights.size(); ++apart) {
      double products = 0.0;
      for (std::size_t i = apart; i < weights.size(); ++i)
        products += weights[i] * weights[i - apart];
      pairs_.push_back((apart == 0 ? 1.0 : 2.0) * products / (sum * sum));
    }
  }
  /// For patches as long as this over slant range.
  double at(double patch_m) const {
    double left = 0.0;
    for (std::size_t apart = 0; apart < pairs_.size(); ++apart) {
      const double on_one = 1.0 - static_cast<double>(apart) * step_m_ / patch_m;
      if (!(on_one > 0.0)) break;
      left += on_one * pairs_[apart];
    }
    return left;
  }
  /// at(), if all ground between the samples counts as well. The weights must change little from
  /// sample to sample.
  double of_all_at(double patch_m) const {
    return at(patch_m) / sum_over_integral(step_m_ / patch_m);
  }

 private:
  double step_m_;
  // By the number of steps between two samples: share of the squared sum.
  std::vector<double> pairs_;
};

/// Amplitudes of ln intensity by octave. The variance of an octave is proportional to its scale, so
/// that the spectrum along a line falls with the squared wavenumber.
std::vector<float> octaves_of(const GroundTexture& texture) {
  std::vector<float> amplitudes;
  double variance = 0.0;
  for (double scale_m = texture.variation_m; scale_m > shortest_m; scale_m *= 0.5) {
    variance += scale_m;
    amplitudes.push_back(static_cast<float>(std::sqrt(scale_m)));
  }
  // Interpolation leaves the share (61 / 70)^2 of the corners' variance: the mean over both axes of
  // u^2 + (1 - u)^2, which is 1 where the interpolation is constant, and 26 / 35 in the middle half
  // of a cell (step_between()).
  const double rms = texture.variation_db * std::numbers::ln10 / 10.0 * 70.0 / 61.0;
  for (float& amplitude : amplitudes) amplitude *= static_cast<float>(rms / std::sqrt(variance));
  return amplitudes;
}

std::uint32_t hashed(std::uint32_t h) {  // the finaliser of Appleby's MurmurHash3
  h = (h ^ (h >> 16)) * 0x85ebca6bu;
  h = (h ^ (h >> 13)) * 0xc2b2ae35u;
  return h ^ (h >> 16);
}

/// Numbers of variance 1 with the skewness of strong patches on weaker ground: a sum of four
/// uniform numbers, which is nearly normal, plus a share of its square.
constexpr float square_share = 0.7f;
constexpr int sums = 4 * 255 + 1;
float number_of(std::uint32_t sum) {
  const float z = (static_cast<float>(sum) - 510.0f) * 0.0067658f;  // 1 / sqrt(4 (256^2 - 1) / 12)
  // The fourth moment of z is 2.7.
  return (z + square_share * (z * z - 1.0f)) * 0.738607f;  // 1 / sqrt(1 + 1.7 square_share^2)
}
float number_at(std::int32_t x, std::int32_t y, std::uint32_t key) {
  const std::uint32_t h = hashed(static_cast<std::uint32_t>(x) * 0xcc9e2d51u +
                                 hashed(static_cast<std::uint32_t>(y) * 0x1b873593u + key));
  return number_of((h & 255u) + ((h >> 8) & 255u) + ((h >> 16) & 255u) + (h >> 24));
}

/// Interpolation over a cell: from 0 to 1 in its middle half, by 3 t^2 - 2 t^3, and constant in the
/// rest.
float step_between(double place) {
  const double t = std::clamp(2.0 * place - 0.5, 0.0, 1.0);
  return static_cast<float>(t * t * (3.0 - 2.0 * t));
}

/// The logarithm of the mean of exp(weight * number), by weight.
class LnMeanExp {
 public:
  LnMeanExp() {
    std::vector<double> share{1.0};  // of each sum
    for (int i = 0; i < 4; ++i) {
      std::vector<double> more(share.size() + 255, 0.0);
      for (std::size_t k = 0; k < share.size(); ++k)
        for (std::size_t byte = 0; byte < 256; ++byte) more[k + byte] += share[k] / 256.0;
      share = std::move(more);
    }
    for (std::size_t i = 0; i < at_step_.size(); ++i) {
      double mean = 0.0;
      for (std::uint32_t sum = 0; sum < sums; ++sum)
        mean += share[sum] * std::exp(static_cast<double>(i) / per_unit * number_of(sum));
      at_step_[i] = static_cast<float>(std::log(mean));
    }
  }
  /// For weights from 0 to `highest`: 6 dB, the most of a material, in one octave is 1.9.
  float at(float weight) const {
    const float place = weight * per_unit;
    const auto step = static_cast<std::size_t>(place);
    return at_step_[step] +
           (at_step_[step + 1] - at_step_[step]) * (place - static_cast<float>(step));
  }

  static constexpr int highest = 2, per_unit = 64;

 private:
  std::array<float, highest * per_unit + 2> at_step_;
};

GammaTable made_quantiles() { return {}; }
LnMeanExp made_ln_mean_exp() { return {}; }

}  // namespace

const GammaTable& TexturedGround::quantiles() { return made_once<made_quantiles>(); }

float TexturedGround::rows_of(double length_m) {
  return static_cast<float>(GammaTable::rows_per_octave * std::log2(length_m));
}

TexturedGround::TexturedGround(const std::vector<GroundTexture>& by_material,
                               const RangeWeights& samples, const RangeWeights& pulse,
                               std::uint64_t seed) {
  std::array<double, 2> random;
  RandomStream(seed, Purpose::ground_texture).uniform(random);
  key_ = static_cast<std::uint32_t>(random[0] * 0x1p32 - 1.0);
  along_x_ = std::cos(std::numbers::pi * random[1]);
  along_y_ = std::sin(std::numbers::pi * random[1]);
  const VarianceLeft in_samples(samples), in_pulse(pulse);
  for (int i = 0; i <= nearest_rows * parts_of_row; ++i)
    along_rows_.push_back(rows_of(
        sum_over_integral(std::exp2(-double(i) / (parts_of_row * GammaTable::rows_per_octave)))));
  for (const GroundTexture& texture : by_material) {
    Kind kind{.texture = texture,
              .units_per_m = units_per_patch / texture.patch_m,
              .patch_rows = rows_of(texture.patch_m),
              .of_angle = {},
              .octaves = octaves_of(texture)};
    const bool varies = texture.variation_db > 0.0;
    for (std::size_t angle = 0; angle < angles; ++angle) {
      const double grazing_rad = (static_cast<double>(angle) + 0.5) * std::numbers::pi / 180.0;
      const double share = texture.glint_share_at(grazing_rad);
      const double variation_db = texture.variation_db_at(grazing_rad);
      const double patch_m = texture.patch_m * std::cos(grazing_rad);  // over slant range
      const double more = in_samples.at(patch_m) / in_pulse.of_all_at(patch_m);
      kind.of_angle.push_back(
          {.row = row_of(more * texture.shape_at(grazing_rad)),
           .glint_row = row_of(more * texture.glint_shape()),
           .glint_share = static_cast<float>(share),
           .even_glint_row = row_of(share * share * (1 << even_log2)),
           .variation = varies ? static_cast<float>(variation_db / texture.variation_db) : 0.0f});
    }
    patchy_ |= texture.shape > 0.0 || texture.glint_share > 0.0;
    varies_ |= varies;
    kinds_.push_back(std::move(kind));
  }
}

/// The rows to add for scatterers that are step_rows apart along the array, relative to a patch.
float TexturedGround::along_rows(float step_rows) const {
  if (step_rows >= 0.0f) return step_rows;
  const auto part = static_cast<std::size_t>(0.5f - step_rows * parts_of_row);
  return part < along_rows_.size() ? along_rows_[part] : 0.0f;
}

void TexturedGround::leave_even(std::size_t n, Places& places) {
  places.x[n] = places.y[n] = places.step_x[n] = places.step_y[n] = 0;
  places.row[n] = places.glint_row[n] = GammaTable::even;
  places.glint_share[n] = 0.0f;
}

const TexturedGround::OfAngle& TexturedGround::at_angle(const Kind& kind, float grazing_rad) const {
  const float degrees = grazing_rad * (180.0f / std::numbers::pi_v<float>);
  return kind.of_angle[std::min(static_cast<std::size_t>(std::max(degrees, 0.0f)), angles - 1)];
}

void TexturedGround::place(std::size_t n, std::uint32_t material, float grazing_rad,
                           const Scatterer& first, Places& places) const {
  const Kind* kind = kind_of(material);
  if (!kind || (kind->texture.shape == 0.0 && kind->texture.glint_share == 0.0))
    return leave_even(n, places);
  const auto units = [&](double at_m) {
    return static_cast<std::uint32_t>(static_cast<std::int64_t>(at_m * kind->units_per_m));
  };
  places.x[n] = units(first.x_m);
  places.y[n] = units(first.y_m);
  places.step_x[n] = units(first.step_x_m);
  places.step_y[n] = units(first.step_y_m);
  const OfAngle& of_angle = at_angle(*kind, grazing_rad);
  const float more = along_rows(first.step_rows - kind->patch_rows);
  const float row = of_angle.row + more, glint_row = of_angle.glint_row + more;
  const bool glints = glint_row < of_angle.even_glint_row;
  places.row[n] = row < even_patch_row ? beginning_of(row) : GammaTable::even;
  places.glint_row[n] = glints ? beginning_of(glint_row) : GammaTable::even;
  places.glint_share[n] = glints ? of_angle.glint_share : 0.0f;
}

/// Octaves of lattice noise: skewed numbers at the corners, interpolated. The mean of each corner's
/// exponential is taken out, so that the factor's mean is 1 everywhere. Each octave is shifted by
/// the finer octaves. This makes the edges of its cells ragged at all scales, like the edges of
/// patches of sediment. The numbers of an octave do not depend on the finer octaves, so the mean
/// stays 1. The lattices of the octaves are turned against each other, so that no direction of a
/// lattice is visible.
float TexturedGround::variation(const Kind& kind, double x_m, double y_m, float grazing_rad) const {
  const LnMeanExp& ln_mean_exp = made_once<made_ln_mean_exp>();
  const float share = at_angle(kind, grazing_rad).variation;
  // Forms are longer along a current by this factor, and narrower across it.
  constexpr double longer = 2.1;
  constexpr double shift = 0.35;  // of a finer cell, per standard deviation of its octave
  // The turn from octave to octave: the golden section of a right angle.
  constexpr double cos_turn = 0.5646348864, sin_turn = 0.8253408054;
  double lattice_x_m = (x_m * along_x_ + y_m * along_y_) / longer;
  double lattice_y_m = (x_m * along_y_ - y_m * along_x_) * longer;
  double scale_m = std::ldexp(kind.texture.variation_m, 1 - static_cast<int>(kind.octaves.size()));
  float sum = 0.0f;
  for (std::size_t octave = kind.octaves.size(); octave-- > 0; scale_m *= 2.0) {
    const double x = lattice_x_m / scale_m, y = lattice_y_m / scale_m;
    const double floor_x = std::floor(x), floor_y = std::floor(y);
    const float u = step_between(x - floor_x), v = step_between(y - floor_y);
    const auto cell_x = static_cast<std::int32_t>(floor_x);
    const auto cell_y = static_cast<std::int32_t>(floor_y);
    const std::uint32_t key = key_ + static_cast<std::uint32_t>(octave + 1) * 0x9e3779b9u;
    const float amplitude = share * kind.octaves[octave];
    float value = 0.0f;
    for (std::int32_t corner = 0; corner < 4; ++corner) {
      const std::int32_t right = corner & 1, up = corner >> 1;
      const float weight = (right ? u : 1.0f - u) * (up ? v : 1.0f - v);
      value += weight * number_at(cell_x + right, cell_y + up, key);
      sum -= ln_mean_exp.at(amplitude * weight);
    }
    sum += amplitude * value;
    lattice_x_m += shift * scale_m * static_cast<double>(value);
    const double turned_x_m = cos_turn * lattice_x_m - sin_turn * lattice_y_m;
    lattice_y_m = sin_turn * lattice_x_m + cos_turn * lattice_y_m;
    lattice_x_m = turned_x_m;
  }
  return std::exp(sum);
}

void TexturedGround::vary(const BinLayers& bins, std::span<float> direct) const {
  if (!varies_) return;
  const auto varying = [&](std::size_t n) -> const Kind* {
    const Kind* kind = kind_of(bins.sediment[n]);
    return kind && kind->texture.variation_db > 0.0 && direct[n] > 0.0f ? kind : nullptr;
  };
  const auto at = [&](const Kind& kind, std::size_t n) {
    return variation(kind, bins.x_m[n], bins.y_m[n], bins.grazing_rad[n]);
  };
  const Kind* kind = nullptr;  // of the last bin that varies; null: none in the group before
  float before = 0.0f;         // its factor
  std::size_t before_bin = 0;
  for (std::size_t begin = 0; begin < direct.size(); begin += signal_group) {
    const std::size_t end = std::min(begin + signal_group, direct.size());
    bool any = false;
    for (std::size_t first = begin; first < end; ++first) {
      const Kind* found = varying(first);
      if (!found) continue;
      // The factor is computed at the last bin of this material in the group, and at its first bin
      // after a change of material. It is linear in between.
      std::size_t last = first, next = first + 1;
      for (; next < end; ++next)
        if (const Kind* other = varying(next); other == found)
          last = next;
        else if (other)
          break;
      const float factor = at(*found, last);
      float slope = 0.0f;
      if (kind && kind != found) {
        before = at(*found, first);
        before_bin = first;
      }
      if (kind && last > before_bin)
        slope = (factor - before) / static_cast<float>(last - before_bin);
      for (std::size_t n = first; n <= last; ++n)
        if (varying(n)) direct[n] *= factor - slope * static_cast<float>(last - n);
      kind = found;
      before = factor;
      before_bin = last;
      any = true;
      first = next - 1;
    }
    if (!any) kind = nullptr;
  }
}

}  // namespace ensonify::engine
