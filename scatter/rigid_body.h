#pragma once

#include <array>
#include <vector>

namespace ensonify::scatter {

// What rigid bodies that do not move return, down to those far smaller than the wavelength. k is
// the wavenumber 2 pi / lambda.

/// The cross-section of a rigid sphere of the radius a, over a^2 / 4: the sum over its modes,
///
///     |sum over n of (-1)^n (2 n + 1) j_n'(ka) / h_n'(ka)|^2 / k^2
///
/// (Faran, J. Acoust. Soc. Am. 23, 405 (1951); Morse and Ingard, Theoretical Acoustics (1968), ch.
/// 8.2). (25 / 9) (ka)^4 if ka is small; 1 from ka = 20 on, where the sum is within 0.25 dB of it.
double rigid_sphere_gain(double ka);

/// The cross-section per square of the length of a rigid cylinder of the radius a, seen across its
/// axis, over a / 2 lambda: the sum over the modes of an infinitely long one,
///
///     |sum over n of e_n (-1)^n J_n'(ka) / H_n'(ka)|^2 / pi^2, e_0 = 1, e_n = 2
///
/// (Faran 1951; finite lengths: Stanton, J. Acoust. Soc. Am. 83, 55 (1988)). (9 pi / 4) (ka)^3 if
/// ka is small; 1 from ka = 20 on, where the sum is within 0.1 dB of it.
double rigid_cylinder_gain(double ka);

/// Both as tables, within 0.02 dB of the sums, which take far longer.
class RigidGains {
 public:
  RigidGains();
  double sphere(double ka) const { return at(sphere_, ka); }
  double cylinder(double ka) const { return at(cylinder_, ka); }
  /// For a place of a surface with these radii of curvature, in any order, over R1 R2 / 4: that of
  /// a sphere if they are equal, of a cylinder if one is far greater. In between their logarithms
  /// are interpolated over the ratio of the radii. The smaller radius is the a of ka.
  double surface(double k_per_m, double radius_m, double other_radius_m) const;

 private:
  struct Table {
    double (*limit)(double ka);    ///< of small ka
    std::vector<double> at_steps;  ///< the gain over limit / (1 + limit), which changes slowly
  };
  static double at(const Table& table, double ka);
  Table sphere_, cylinder_;
};

/// A body as an ellipsoid: its volume and the half axes with its second moments.
struct RigidBody {
  double volume_m3;
  std::array<double, 3> half_axes_m;
};

/// The share L_i of each axis of an ellipsoid, which sum to 1: the fluid that moves with it along
/// an axis has L / (1 - L) times its volume (Lamb, Hydrodynamics (1932), art. 114, with 2 L for
/// alpha_0). By Carlson's integral R_D, Numer. Math. 33, 1 (1979).
std::array<double, 3> ellipsoid_shares(const std::array<double, 3>& half_axes_m);

/// The cross-section of a rigid body that is small against the wavelength (k times its radius up to
/// 2), m^2. direction: to the sonar, unit, along the body's axes. Far below that it is
///
///     (k^2 V / 4 pi)^2 (1 + 1 / (1 - L))^2
///
/// with the mean of 1 / (1 - L) over the squares of the direction (Rayleigh's limit: Van Bladel, J.
/// Acoust. Soc. Am. 44, 1069 (1968)): (25 / 36) k^4 a^6 for a sphere. Elsewhere the phases of its
/// parts count, as those in an ellipsoid, F(2 k h)^2 with F(u) = 3 j_1(u) / u and its half depth h
/// in the direction; and a factor of the volume, with which a sphere has its sum over modes.
double small_body_cross_section(const RigidBody& body, const std::array<double, 3>& direction,
                                double k_per_m);

}  // namespace ensonify::scatter
