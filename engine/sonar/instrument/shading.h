#pragma once

#include <complex>
#include <span>
#include <vector>

namespace ensonify::engine {

/// How the elements of a line array are weighted. `same` is for receivers only: the transmitter's
/// shading.
enum class ShadingKind { uniform, hann, taylor, chebyshev, weights, same };

/// The weight w(u) of a line array over its length, u from -1/2 to 1/2. It is even, and its mean is
/// 1. So the far field on the axis is 1 for every shading, and the source level keeps its meaning.
///
/// Angles are x = L sin(psi) / lambda, for an array of length L.
class Shading {
 public:
  /// The uniform shading: the weight is 1.
  Shading() = default;
  /// 1 + cos(2 pi u): the highest side lobe is at -31.5 dB.
  static Shading hann();
  /// Taylor, IRE Trans. Antennas Propag. 3, 16 (1955): the first nbar - 1 side lobes are nearly at
  /// side_lobe_db, the lobes beyond these fall as 1 / x. Throws std::invalid_argument if nbar is
  /// below min_nbar().
  static Shading taylor(double side_lobe_db, int nbar);
  /// Dolph, Proc. IRE 34, 335 (1946): an array of chebyshev_elements elements of equal length,
  /// weighted so that all side lobes are at side_lobe_db. The pattern of one element, sinc^2(x /
  /// 128), lowers the lobes farther out: by 0.1 dB at x = 10, 0.35 dB at x = 20.
  static Shading chebyshev(double side_lobe_db);
  /// The weights of elements of equal length, from one end to the other, in any scale. Throws
  /// std::invalid_argument if there are none, if they are not symmetric, or if their sum is not
  /// positive.
  static Shading of_weights(std::span<const double> weights);

  static constexpr int chebyshev_elements = 128;
  /// The smallest nbar with which Taylor's side lobes are this low: 2 A^2 + 1/2. With a smaller
  /// nbar the moved nulls do not join the unmoved nulls. 3 at -25 dB, 6 at -40 dB.
  static int min_nbar(double side_lobe_db);

  bool uniform() const { return waves_.empty() && elements_.empty(); }
  /// The weight at u; on the border of two elements, the mean of their weights.
  double at(double u) const;
  /// The amplitude in the far field, or of a focused array: the integral of w exp(-i 2 pi x u).
  double far_field(double x) const;
  /// The field in the near field: the integral of w exp(i 2 pi (F u^2 - x u)), Fresnel's
  /// approximation. `nearness` is F = L^2 / (2 lambda r) times the defocus (Sonar::defocus()), of
  /// either sign.
  std::complex<double> field(double x, double nearness) const;
  /// The x of null `number` of the far field, counted from 1; a dip between two lobes counts as a
  /// null. 0 for a number below 1. Nulls beyond the known ones are taken as 1 apart.
  double null_x(int number) const;
  /// Width of the far field's beam in x, one way, -3 dB to -3 dB.
  double beam_width_x() const;
  /// Width in x of a beam that has the gain of this array's axis over its whole width, and that
  /// receives as much isotropic noise as this array: the mean of w^2, by Parseval's theorem the
  /// integral of far_field()^2. 1 if uniform.
  double noise_width_x() const;
  /// The least number of steps, at least `steps`, for Simpson's rule over the array or over half of
  /// it, such that each border of an element is at the end of a pair of steps.
  int whole_steps(int steps) const;

  bool operator==(const Shading&) const = default;

 private:
  void find_nulls();

  std::vector<double> waves_;     // F_m of w(u) = 1 + 2 sum F_m cos(2 pi m u)
  std::vector<double> elements_;  // or the weights of equal elements
  std::vector<double> nulls_;     // none if uniform
};

}  // namespace ensonify::engine
