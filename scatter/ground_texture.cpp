#include <ensonify/scatter/ground_texture.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include <ensonify/scatter/angle.h>
#include <ensonify/scatter/log_gamma.h>

namespace ensonify::scatter {
namespace {

constexpr double lowest_grazing_rad = 5.0 * degree;
// The integral of exp(-x) / x from 0.1 on, Abramowitz and Stegun (1964), table 5.1.
constexpr double points_per_shape = 1.8229;

double over_sine_10(double grazing_rad) {
  return std::sin(std::max(grazing_rad, lowest_grazing_rad)) / std::sin(10.0 * degree);
}

}  // namespace

double GroundTexture::shape_at(double grazing_rad) const {
  if (shape == 0.0) return std::numeric_limits<double>::infinity();
  return shape * std::pow(over_sine_10(grazing_rad), exponent);
}

double GroundTexture::glint_share_at(double grazing_rad) const {
  const double bed = (1.0 - glint_share) * std::pow(over_sine_10(grazing_rad), 2.0);
  return glint_share / (glint_share + bed);
}

double GroundTexture::variation_db_at(double grazing_rad) const {
  return exponent == 0.0 ? variation_db : variation_db * std::pow(std::cos(grazing_rad), 2.0);
}

double GroundTexture::glint_shape() const {
  return glints_per_m2 * patch_m * patch_m / points_per_shape;
}

// The texture follows from the sound speed, because each sediment has one, with or without a name.
// In silt (4.5 phi) sound is as fast as in the water, within 2 %; in sandy gravel (-1 phi) 1.34
// times as fast, in rock 2.5 times. How the values were chosen: bench/realism.
GroundTexture ground_texture_of(const Sediment& sediment) {
  if (sediment.sound_speed_ratio < 1.05)  // silt and clay
    return {.shape = 1.2, .glint_share = 0.03, .glints_per_m2 = 3.0, .variation_db = 1.4};
  if (sediment.sound_speed_ratio < 1.33)  // sand
    return {.shape = 0.9, .glint_share = 0.27, .glints_per_m2 = 3.0, .variation_db = 2.1};
  if (sediment.sound_speed_ratio < 2.0)  // gravel and stones
    return {.shape = 0.5, .glint_share = 0.37, .glints_per_m2 = 7.0, .variation_db = 2.7};
  return {.shape = 0.25, .glint_share = 0.1, .glints_per_m2 = 10.0, .variation_db = 3.0};  // rock
}

// Goes from large values x downwards, in even steps of ln x, and sums the share of larger values
// and their contribution to the mean. Then the mean of each column follows from the differences of
// both sums at the column's ends.
GammaTable::GammaTable() : values_(static_cast<std::size_t>(rows) * columns, 1.0f) {
  constexpr int steps = 4200;
  constexpr double highest_ln = 11.0, step = 0.005;
  for (int row = 0; row + 1 < rows; ++row) {
    const double shape = std::exp2(lowest_log2 + static_cast<double>(row) / rows_per_octave);
    const double ln_scale = shape * std::log(shape) - log_gamma(shape);
    std::vector<double> share{0.0}, mean{0.0};
    for (int i = 0; i < steps; ++i) {
      const double ln_x = highest_ln - (i + 0.5) * step, x = std::exp(ln_x);
      const double probability = step * std::exp(ln_scale + shape * ln_x - shape * x);
      share.push_back(share.back() + probability);
      mean.push_back(mean.back() + x * probability);
    }
    std::size_t i = 0;
    const auto mean_above = [&](double v) {  // v ascends from call to call
      while (i + 1 < share.size() && share[i + 1] < v) ++i;
      if (i + 1 == share.size()) return mean.back();
      return mean[i] + (mean[i + 1] - mean[i]) * (v - share[i]) / (share[i + 1] - share[i]);
    };
    double from_v = 0.0, from_mean = 0.0;
    for (int column = 0; column < columns; ++column) {
      const double part = static_cast<double>(column % columns_per_octave + 1) / columns_per_octave;
      const double to_v = std::ldexp(1.0 + part, column / columns_per_octave - octaves);
      const double to_mean = column + 1 < columns ? mean_above(to_v) : mean.back();
      values_[static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column)] =
          static_cast<float>((to_mean - from_mean) / (to_v - from_v) / mean.back());
      from_v = to_v;
      from_mean = to_mean;
    }
  }
}

int GammaTable::column_of(float share) {
  static_assert(columns_per_octave == 1 << 4);
  const int step = static_cast<int>(std::bit_cast<std::uint32_t>(share) >> (23 - 4));
  return std::clamp(step - (127 - octaves) * columns_per_octave, 0, columns - 1);
}

int GammaTable::row_of(double log2_shape) {
  const double row = (log2_shape - lowest_log2) * rows_per_octave;
  return static_cast<int>(std::lround(std::clamp(row, 0.0, static_cast<double>(rows - 1))));
}

}  // namespace ensonify::scatter
