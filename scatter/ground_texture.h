#pragma once

#include <cstddef>
#include <vector>

#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {

/// How unevenly a bed scatters where its mean strength is the same: patches and single stones
/// smaller than what a sonar resolves, and a slow change of strength over metres.
///
/// A patch has a random share of the mean cross-section, gamma distributed with mean 1. A
/// resolution cell adds its patches, and a sum of n gamma variables of one shape k is gamma of the
/// shape n k: so the echo's intensity is K distributed, with <I^2> / <I>^2 = 2 (1 + 1 / shape of
/// the cell), and that shape grows with the cell's area, as Abraham and Lyons, IEEE J. Oceanic
/// Eng. 27, 800 (2002) derive from a finite number of scatterers. A cell much smaller than a patch
/// has the patch's shape.
struct GroundTexture {
  double patch_m = 0.06;  ///< side of a patch
  /// Shape of a patch's cross-section at 10 degrees grazing; it grows with the sine of the grazing
  /// angle to the power `exponent`. 0: all patches are alike.
  double shape = 0.0;
  double exponent = 3.0;
  /// Share of the mean cross-section at 10 degrees that comes from single points (stones, shells),
  /// and the number of points per m^2. The strength of the points is the same at all angles; that
  /// of the bed grows with the squared sine.
  double glint_share = 0.0, glints_per_m2 = 10.0;
  double variation_db = 0.0;  ///< rms of the slow change of strength at low grazing angles
  double variation_m = 40.0;  ///< the longest scale of it; it goes down to 1 m

  /// Shape of a patch at a grazing angle; below 5 degrees that at 5. Infinite if all are alike.
  double shape_at(double grazing_rad) const;
  /// Share of the mean cross-section at a grazing angle that comes from points.
  double glint_share_at(double grazing_rad) const;
  /// Rms of the slow change of strength at a grazing angle. It falls with the squared cosine: where
  /// sound meets the bed steeply, the echo depends less on roughness, stones and shells. With
  /// `exponent` 0 it is the same at all angles.
  double variation_db_at(double grazing_rad) const;
  /// Shape of the points' cross-section in one patch. The points of a gamma field have all
  /// strengths x with the density exp(-x) / x per shape; this counts those above a tenth of the
  /// largest usual ones.
  double glint_shape() const;
  bool even() const { return shape == 0.0 && glint_share == 0.0 && variation_db == 0.0; }
};

/// Typical of a sediment. Patches and points of sand and gravel were chosen by two recordings at
/// 600 kHz: how many samples exceed 2, 3, 4, 5 and 6 times the mean around them at each grazing
/// angle, and their contrast. Through a survey's recorder a bed of gravel has about those of a
/// mixed bed, and sand has some between those of a river's sand and of the mixed bed
/// (tests/physics/texture_test.cpp, bench/realism/tails.py). The slow change of strength was chosen
/// so that levels change as in these recordings over 1 to 16 m of the track at each grazing angle,
/// and forms of 0.3 to 2.4 m have a similar contrast and skew (bench/realism has the differences).
/// The textures of other beds are scaled by the kind of bed, and are not measured.
GroundTexture ground_texture_of(const Sediment& sediment);

/// Quantiles of gamma distributions of mean 1, for random numbers: rows by shape, columns by the
/// share v of larger values. The columns are even in v's floating-point form, 16 per octave down to
/// 2^-16, so that large values are resolved. A column has the mean of its part of the
/// distribution, so that each row's mean is 1.
class GammaTable {
 public:
  static constexpr int columns_per_octave = 16, octaves = 16;
  static constexpr int columns = columns_per_octave * octaves;
  static constexpr int rows_per_octave = 8;
  static constexpr int lowest_log2 = -8, highest_log2 = 8;
  /// The last row is that of an infinite shape: all values are 1.
  static constexpr int rows = rows_per_octave * (highest_log2 - lowest_log2) + 2;
  static constexpr int even = (rows - 1) * columns;  ///< where that row begins in values()

  GammaTable();
  /// The nearest row to a shape, by its logarithm to the base 2.
  static int row_of(double log2_shape);
  /// The column of a share of larger values, in (0, 1].
  static int column_of(float share);
  const std::vector<float>& values() const { return values_; }
  float value(int row, int column) const {
    return values_[static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column)];
  }

 private:
  std::vector<float> values_;
};

}  // namespace ensonify::scatter
