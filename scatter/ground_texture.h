#pragma once

#include <cstddef>
#include <vector>

#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {

/// How the strength of a bed varies around its mean: by patches and single stones that are smaller
/// than what a sonar resolves, and by a slow change over metres.
///
/// The cross-section of a patch is the mean times a random number that is gamma distributed with
/// mean 1. A resolution cell adds its patches. The sum of n gamma variables of one shape k is gamma
/// of the shape n k. So the echo's intensity I is K distributed, with <I^2> / <I>^2 = 2 (1 + 1 /
/// shape of the cell), and this shape grows with the cell's area. Abraham and Lyons, IEEE J.
/// Oceanic Eng. 27, 800 (2002) derive the same from a finite number of scatterers. A cell that is
/// much smaller than a patch has the patch's shape.
struct GroundTexture {
  double patch_m = 0.06;  ///< side of a patch
  /// Shape of the distribution of a patch's cross-section, at 10 degrees grazing. The shape grows
  /// with the sine of the grazing angle to the power `exponent`. 0: all patches are equal.
  double shape = 0.0;
  double exponent = 3.0;
  /// Share of the mean cross-section at 10 degrees that comes from single points (stones, shells),
  /// and the number of points per m^2. The strength of the points is the same at all angles; the
  /// strength of the bed between them grows with the squared sine.
  double glint_share = 0.0, glints_per_m2 = 10.0;
  double variation_db = 0.0;  ///< rms of the slow change of strength at low grazing angles
  double variation_m = 40.0;  ///< the longest scale of this change; the shortest is 1 m

  /// Shape of a patch at a grazing angle (below 5 degrees: at 5). Infinite if all patches are
  /// equal.
  double shape_at(double grazing_rad) const;
  /// Share of the mean cross-section at a grazing angle that comes from points.
  double glint_share_at(double grazing_rad) const;
  /// Rms of the slow change of strength at a grazing angle. It is proportional to the squared
  /// cosine, because an echo from a steep angle depends less on roughness, stones and shells. If
  /// `exponent` is 0, it is the same at all angles.
  double variation_db_at(double grazing_rad) const;
  /// Shape of the distribution of the points' cross-section in one patch. The points of a gamma
  /// field have all strengths x, with the density exp(-x) / x per unit of shape. glints_per_m2
  /// counts those with x above 0.1, a tenth of the largest usual strength.
  double glint_shape() const;
  bool even() const { return shape == 0.0 && glint_share == 0.0 && variation_db == 0.0; }
};

/// The typical texture of a sediment. The patches and points of sand and gravel were chosen to
/// agree with two recordings at 600 kHz in two respects, at each grazing angle: how many samples
/// exceed 2, 3, 4, 5 and 6 times the mean around them, and the contrast. With a survey's recorder,
/// a simulated bed of gravel is near the recorded mixed bed in both respects. Simulated sand lies
/// between the recorded sand of a river and the recorded mixed bed (tests/physics/texture_test.cpp,
/// bench/realism/tails.py). The slow change of strength was chosen so that, at each grazing angle,
/// levels change over 1 to 16 m of the track as in these recordings, and forms of 0.3 to 2.4 m have
/// a similar contrast and skew (bench/realism has the differences). The textures of other beds are
/// scaled by the kind of bed, and are not measured.
GroundTexture ground_texture_of(const Sediment& sediment);

/// Quantiles of gamma distributions with mean 1, for making random numbers. A row belongs to a
/// shape, a column to an interval of v, the share of larger values. The columns have even steps in
/// the floating-point form of v, 16 per octave down to 2^-16, so that large values are resolved. A
/// column holds the mean of the values in its interval, so each row's mean is 1.
class GammaTable {
 public:
  static constexpr int columns_per_octave = 16, octaves = 16;
  static constexpr int columns = columns_per_octave * octaves;
  static constexpr int rows_per_octave = 8;
  static constexpr int lowest_log2 = -8, highest_log2 = 8;
  /// The last row is for an infinite shape: all its values are 1.
  static constexpr int rows = rows_per_octave * (highest_log2 - lowest_log2) + 2;
  static constexpr int even = (rows - 1) * columns;  ///< where the last row begins in values()

  GammaTable();
  /// The row that is nearest to a shape, which is given by its logarithm to the base 2.
  static int row_of(double log2_shape);
  /// The column that contains a share of larger values, which is in (0, 1].
  static int column_of(float share);
  const std::vector<float>& values() const { return values_; }
  float value(int row, int column) const {
    return values_[static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column)];
  }

 private:
  std::vector<float> values_;
};

}  // namespace ensonify::scatter
