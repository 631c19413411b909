#pragma once

#include <complex>
#include <span>
#include <vector>

namespace ensonify::engine {

/// How the elements of a line array are weighted. `same` is for receivers only: as the transmitter.
enum class ShadingKind { uniform, hann, taylor, chebyshev, weights, same };

/// The weight w(u) of a line array over its length, u from -1/2 to 1/2: even, and 1 in the mean. So
/// the far field on the axis is 1 for every shading, and the source level keeps its meaning.
///
/// Angles are x = L sin(psi) / lambda, for an array of length L.
class Shading {
 public:
  /// Uniform.
  Shading() = default;
  /// 1 + cos(2 pi u): the highest side lobe is at -31.5 dB.
  static Shading hann();
  /// Taylor, IRE Trans. Antennas Propag. 3, 16 (1955): the first nbar - 1 side lobes are nearly at
  /// side_lobe_db, those beyond fall as 1 / x. Throws std::invalid_argument if nbar is below
  /// min_nbar().
  static Shading taylor(double side_lobe_db, int nbar);
  /// Dolph, Proc. IRE 34, 335 (1946): an array of chebyshev_elements equal elements, which together
  /// have all side lobes at side_lobe_db. Each element is an even piece of the array, and its own
  /// pattern sinc^2(x / 128) lowers them farther out: by 0.1 dB at x = 10, 0.35 dB at x = 20.
  static Shading chebyshev(double side_lobe_db);
  /// One weight for each of some equal elements, from one end to the other, in any scale. Throws
  /// std::invalid_argument unless there are some, they are the same from both ends and their sum is
  /// positive.
  static Shading of_weights(std::span<const double> weights);

  static constexpr int chebyshev_elements = 128;
  /// The smallest nbar with which Taylor's side lobes are this low, 2 A^2 + 1/2: with fewer
  /// the moved nulls do not join the unmoved ones. 3 at -25 dB, 6 at -40 dB.
  static int min_nbar(double side_lobe_db);

  bool uniform() const { return waves_.empty() && elements_.empty(); }
  /// The weight at u; on the border of two elements their mean.
  double at(double u) const;
  /// The amplitude in the far field, or of a focused array: the integral of w exp(-i 2 pi x u).
  double far_field(double x) const;
  /// The field in the near field: the integral of w exp(i 2 pi (F u^2 - x u)), Fresnel's
  /// approximation. `nearness` is F = L^2 / (2 lambda r) times the defocus (Sonar::defocus()), of
  /// either sign.
  std::complex<double> field(double x, double nearness) const;
  /// Where null `number` of the far field is, counted from 1; a dip between two lobes counts as a
  /// null. 0 for a number below 1; nulls beyond those that were found are taken as 1 apart.
  double null_x(int number) const;
  /// Width of the far field's beam in x, one way, -3 dB to -3 dB.
  double beam_width_x() const;
  /// Width of a beam in x that has the same gain on its axis everywhere, and receives as much
  /// isotropic noise as this one: the mean of w^2, by Parseval's theorem the integral of
  /// far_field()^2. 1 if uniform.
  double noise_width_x() const;
  /// The least number of steps, at least `steps`, for Simpson's rule over the array or over half of
  /// it, such that each border of an element is at the end of a double step.
  int whole_steps(int steps) const;

  bool operator==(const Shading&) const = default;

 private:
  void find_nulls();

  std::vector<double> waves_;     // F_m of w(u) = 1 + 2 sum F_m cos(2 pi m u)
  std::vector<double> elements_;  // or the weights of equal elements
  std::vector<double> nulls_;     // none if uniform
};

}  // namespace ensonify::engine
