#pragma once

#include <array>
#include <vector>

namespace ensonify::scatter {

// The echo of rigid bodies that do not move, also of those that are far smaller than the
// wavelength. k is the wavenumber 2 pi / lambda.

/// The cross-section of a rigid sphere of radius a, divided by a^2 / 4: the sum over its modes,
///
///     |sum over n of (-1)^n (2 n + 1) j_n'(ka) / h_n'(ka)|^2 / k^2
///
/// (Faran, J. Acoust. Soc. Am. 23, 405 (1951); Morse and Ingard, Theoretical Acoustics (1968), ch.
/// 8.2). For small ka it is (25 / 9) (ka)^4. From ka = 20 on, where the sum is within 0.25 dB of 1,
/// it is 1.
double rigid_sphere_gain(double ka);

/// The cross-section of a rigid cylinder of radius a and length L, seen at a right angle to its
/// axis, divided by L^2 a / (2 lambda): the sum over the modes of an infinitely long cylinder,
///
///     |sum over n of e_n (-1)^n J_n'(ka) / H_n'(ka)|^2 / pi^2, e_0 = 1, e_n = 2
///
/// (Faran 1951; finite lengths: Stanton, J. Acoust. Soc. Am. 83, 55 (1988)). For small ka it is (9
/// pi / 4) (ka)^3. From ka = 20 on, where the sum is within 0.1 dB of 1, it is 1.
double rigid_cylinder_gain(double ka);

/// Tables of both gains, within 0.02 dB of the sums, which take far longer.
class RigidGains {
 public:
  RigidGains();
  double sphere(double ka) const { return at(sphere_, ka); }
  double cylinder(double ka) const { return at(cylinder_, ka); }
  /// The gain of a place on a surface with these two radii of curvature, in any order: the
  /// cross-section divided by R1 R2 / 4. It is the gain of a sphere if the radii are equal, and of
  /// a cylinder if one radius is far greater. In between, the logarithms of these two gains are
  /// interpolated over the ratio of the radii. The smaller radius is the a of ka.
  double surface(double k_per_m, double radius_m, double other_radius_m) const;

 private:
  struct Table {
    double (*limit)(double ka);    ///< the gain for small ka
    std::vector<double> at_steps;  ///< gain divided by limit / (1 + limit), which changes slowly
  };
  static double at(const Table& table, double ka);
  Table sphere_, cylinder_;
};

/// A body: its volume, and the half axes of the ellipsoid with the same second moments.
struct RigidBody {
  double volume_m3;
  std::array<double, 3> half_axes_m;
};

/// The factors L_i for the three axes of an ellipsoid; they sum to 1. If the ellipsoid moves along
/// an axis, the water that moves with it has L / (1 - L) times the ellipsoid's volume (Lamb,
/// Hydrodynamics (1932), art. 114, where alpha_0 is 2 L). Computed by Carlson's integral R_D,
/// Numer. Math. 33, 1 (1979).
std::array<double, 3> ellipsoid_shares(const std::array<double, 3>& half_axes_m);

/// The cross-section, m^2, of a rigid body that is small compared with the wavelength (k times its
/// radius is at most 2). direction: unit vector to the sonar, along the body's axes. If the body is
/// much smaller still, the cross-section is
///
///     (k^2 V / 4 pi)^2 (1 + 1 / (1 - L))^2
///
/// where 1 / (1 - L) is the mean over the axes, weighted with the squared components of the
/// direction (Rayleigh's limit: Van Bladel, J. Acoust. Soc. Am. 44, 1069 (1968)). For a sphere of
/// radius a this is (25 / 36) k^4 a^6. For larger bodies there are two more factors. One is F(2 k
/// h)^2 with F(u) = 3 j_1(u) / u, where h is the body's half depth in the direction. It accounts
/// for the different phases of the body's parts, as in an ellipsoid. The other factor depends only
/// on k and the volume. It makes the cross-section of a sphere exactly the sum over its modes.
double small_body_cross_section(const RigidBody& body, const std::array<double, 3>& direction,
                                double k_per_m);

}  // namespace ensonify::scatter
