#pragma once

#include <optional>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/objects/object_surface.h>

namespace ensonify::engine {

// Glints: the mirror-like part of a solid's echo. By physical optics a flat part L1 x L2 that lies
// at the range r, whose normal is inclined by t_i to the sonar in the direction of L_i, has the
// cross-section
//
//     I_1 I_2 / lambda^2,  I = |integral over L of exp(i k (z - r t)^2 / r) dz|^2,
//
// with Fresnel's integral (Abramowitz and Stegun, ch. 7): far away I = L^2 sinc^2(2 L t / lambda),
// which gives a plate its A^2 / lambda^2; near it I = lambda r / 2, which gives a mirror its
// r^2 / 4. Of a round flat part the integral is over its ellipse: far away (A / lambda 2 J1(x) /
// x)^2, x = 4 pi / lambda times the root of (a t)^2 + (b s)^2, for its half axes a and b. Where
// facets stand for a curved surface, they share its energy: there
//
//     I = (lambda r / 4) (erf((t + h) / s) - erf((t - h) / s)),  h = L / 2 r,
//
// a lobe of the same energy whose half width s is the facet's bend (FlatPart), about the angle
// between neighbouring facets, so that facets sum to the round body: a^2 / 4 for a sphere, R1 R2 /
// 4 for what has the radii R1 and R2 there; a L^2 / (2 lambda) for a cylinder far away, a r / 4
// near it. (Urick's a r / 2 is that of plane waves; those of a sonar are curved by 1 / r.)
//
// Two flat parts in a right angle send sound back to where it came from, by way of both. Seen in
// the plane across their edge, at the angles g_i to the flat parts, which reach w_i from it, that
// is a mirror of the width W = 2 min(w_1 sin g_1, w_2 sin g_2) that faces the sonar; along the edge
// it is a flat part. So, far away, it has
//
//     sigma = W^2 L^2 / lambda^2,
//
// 2 a^2 L^2 / lambda^2 for two equal flat parts seen from the middle (Ruck, Radar Cross Section
// Handbook, 1970, ch. 8: 8 pi a^2 L^2 / lambda^2 over 4 pi). An angle that is d over a right one
// turns what returns by 2 d: I = |2 integral from 0 to W / 2 of exp(i k (z + r d)^2 / r) dz|^2.
// Both reflections lose.

/// One direction of a flat part at a range, whose normal is inclined by `tilt` to the sonar.
struct MirrorExtent {
  double length_m;
  double lobe;   ///< half its width, a sine
  double reach;  ///< the sine to which a normal may be inclined to have a glint
  double tilt;   ///< a sine
  double range_m;
  bool curved;

  /// bend_rad: that of a FlatPart in this direction; 0 for a flat one.
  MirrorExtent(double its_length_m, double bend_rad, double its_tilt, double its_range_m,
               double wavelength_m);
  bool reaches() const;
  bool is_far(double wavelength_m) const;  ///< far enough for the sinc of a plane wave
  /// I, m^2.
  double power_m2(double wavelength_m) const;
  /// The phase of a flat one's integral, against that of the path to its nearest place.
  double phase_rad(double wavelength_m) const;
};

/// The part of a flat part, or of the curved surface that it stands for, that is most nearly a
/// mirror.
struct Mirror {
  Eigen::Vector3d offset;  ///< from the flat part's middle
  MirrorExtent one, other;
  bool round;  ///< an ellipse

  double cross_section_m2(double wavelength_m) const;
  /// The phase of a flat rectangle's echo, against that of the path to the place.
  double phase_rad(double wavelength_m) const;
};

/// That of a flat part whose middle is `away` from the sonar; none where it has no glint.
std::optional<Mirror> mirror_of(const FlatPart& flat_part, const Eigen::Vector3d& away,
                                double wavelength_m);

/// Of a ball about the block's middle that contains the places of its flat parts' glints.
double glint_radius_m(const FlatPartBlock& block);

/// The largest inclination (a sine) of a normal of the block to the sonar at which its flat part
/// has a glint.
double glint_reach(const FlatPartBlock& block, double wavelength_m);

/// I of a right corner across its edge, m^2.
double corner_power_m2(double width_m, double excess_rad, double range_m, double wavelength_m);

}  // namespace ensonify::engine
