#pragma once

#include <complex>
#include <functional>
#include <optional>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/objects/object_surface.h>
#include <ensonify/engine/sonar/echo/beam.h>

namespace ensonify::engine {

// Glints: the mirror-like part of a solid's echo. By physical optics a flat part L1 x L2 that lies
// at the range r, whose normal is inclined by t_i to the sonar in the direction of L_i, has the
// cross-section
//
//     I_1 I_2 / lambda^2,  I = |integral over L of exp(i k (z - r t)^2 / r) dz|^2,
//
// with Fresnel's integral (Abramowitz and Stegun, ch. 7): far away I = L^2 sinc^2(2 L t / lambda),
// so that a plate has A^2 / lambda^2; near it I = lambda r / 2, so that a mirror has r^2 / 4. For a
// round flat part the integral is over its ellipse: far away (A / lambda 2 J1(x) / x)^2, x = 4 pi /
// lambda times the root of (a t)^2 + (b s)^2, for its half axes a and b.
//
// A curved surface has a glint where its normal n is the direction d to the sonar. Between the
// corners of a facet both change evenly. So the glint is in the facet whose corners have n - d
// around 0, seen along d. A triangle of the area A, over which n - d spans the solid angle W, has
//
//     sigma = A / 4 W,
//
// which is R1 R2 / 4 far away for the radii R1 and R2, a^2 / 4 for a sphere, and at most r^2 / 4,
// the value of a mirror. W / A contains the Gaussian curvature in the middle of the triangle; the
// curvature changes towards the corners. Neighbouring facets share corners, so that only one of
// them has the glint. A strip has the glint on a straight line, if the sonar is between the two
// planes that contain the strip's sides and the normals there. With the width w there and the
// distance g from one plane to the sonar and on to the other plane, a strip has
//
//     sigma = |integral over the line of sqrt(r w / 2 lambda g) exp(i k (z - r t)^2 / r) dz|^2,
//
// which is a L^2 / (2 lambda) for a cylinder far away, and a r / 4 near it. (Urick's a r / 2 is for
// plane waves; the waves of a sonar are curved by 1 / r.) The focusing by a hollow surface is left
// out.
//
// Both sigma hold for short waves. Where k times the smaller radius is below 20, they are replaced
// by the sums over the modes of a rigid sphere or of a long rigid cylinder (scatter/rigid_body.h).
// If k times the radius is from 1 to 2, the sums are up to 4 dB less; far below 1 they have
// Rayleigh's limit. The radii are those at the place of the glint, as if the whole body had them.
//
// Two flat parts in a right angle send sound back to where it came from, by way of both. Let the
// flat parts extend w_i from their common edge, and let the sonar be at the angle g_i to each of
// them. In the plane across the edge, they are a mirror of the width W = 2 min(w_1 sin g_1, w_2 sin
// g_2) that faces the sonar. Along the edge they are like a flat part. So, far away, a corner has
//
//     sigma = W^2 L^2 / lambda^2,
//
// 2 a^2 L^2 / lambda^2 for two equal flat parts seen from the middle (Ruck, Radar Cross Section
// Handbook, 1970, ch. 8: 8 pi a^2 L^2 / lambda^2 over 4 pi). An angle that exceeds a right angle by
// d turns what returns by 2 d: I = |2 integral from 0 to W / 2 of exp(i k (z + r d)^2 / r) dz|^2.
// Both reflections lose energy.
//
// Where the beam changes over what returns the sound, its two-way field b is part of the integral:
//
//     sigma = |integral of b exp(i k ...)|^2 / lambda^2.
//
// This is used where the beam is not wide compared with the Fresnel zone (glint_in_beam.h). Over a
// flat part, the integral across the array is Fresnel's integral, and the integral along the array
// is a sum. Elsewhere b is the field at the place of the glint.

/// A sonar's arrays, for glints in a beam that is narrow against what returns the sound.
struct GlintBeam {
  const Beam& beam;
  const ReceiverMotion& motion;
  Eigen::Vector3d array_axis;  ///< unit
  double array_m;              ///< the length of the longer array
  double sin_truncation;       ///< as in FanGrid
};

/// A straight line of a surface at a range, whose normal is inclined by `tilt` to the sonar.
struct MirrorExtent {
  double length_m;
  double tilt;  ///< a sine
  double range_m;

  /// Whether it has a glint; array_m: the length of an array whose beam counts.
  bool reaches(double wavelength_m, double array_m = 0.0) const;
  /// The integral whose square is I. Its phase is relative to the path to the foot of the line of
  /// sight, also if this is not on the line.
  std::complex<double> field_m(double wavelength_m) const;
  /// I, m^2.
  double power_m2(double wavelength_m) const { return std::norm(field_m(wavelength_m)); }
  /// The phase of the integral, relative to the path to the nearest place of the line.
  double phase_rad(double wavelength_m) const;
};

/// The straight line of a strip that has a glint.
struct MirrorLine {
  Eigen::Vector3d middle;  ///< from the flat part's middle
  Eigen::Vector3d away;    ///< from where the sonar appears to be
  Eigen::Vector3d along;   ///< unit
  double length_m;
  double width, other_width;  ///< scaled so that line_glint_in_beam() gives the cross-section
  double radius_m;            ///< of the surface across the line, on average
};

/// The glint of a flat part, or of the curved surface that it stands for.
struct Mirror {
  Eigen::Vector3d offset;  ///< from the flat part's middle to the place of the glint
  /// The offset of a place near it that is well inside the flat part, because rays next to the
  /// edges pass the part, or meet what lies beside it.
  Eigen::Vector3d inside;
  double cross_section_m2;
  double phase_rad;      ///< of a piece's echo, relative to the path to the place
  bool in_beam = false;  ///< the cross-section contains the beam along the array
  std::optional<MirrorLine> line = {};
};

/// Where the sonar appears to be from a place.
using SonarFrom = std::function<Eigen::Vector3d(const Eigen::Vector3d& place)>;

/// The glint of a flat part; none if it has no glint. away: its middle, from the sonar. curved: the
/// facets of its body. sonar_from: where the sonar appears to be from other places of a curved
/// part; empty: at one place. beam: null if the whole flat part is on the beam's axis.
std::optional<Mirror> mirror_of(const FlatPart& flat_part, const CurvedFacets& curved,
                                const Eigen::Vector3d& away, double wavelength_m,
                                const SonarFrom& sonar_from = {}, const GlintBeam* beam = nullptr);

/// The glint of a straight line whose middle is `middle` away from the sonar.
struct LineGlint {
  double place_m;  ///< along the line, from its middle
  double range_m;
  /// |integral of the root of the width exp(i k (z - r t)^2 / r) dz|^2.
  double power_m3;
  bool in_beam;  ///< as in Mirror
};

/// The glint of a line of a surface whose width changes evenly from one value to another; none if
/// it has no glint.
std::optional<LineGlint> glint_of_line(const Eigen::Vector3d& middle, const Eigen::Vector3d& along,
                                       double length_m, double width_m, double other_width_m,
                                       double wavelength_m, const GlintBeam* beam);

/// The largest inclination (a sine) of a normal of the block to a sonar at which its flat part has
/// a glint, at ranges of at least range_m.
double glint_reach(const FlatPartBlock& block, double wavelength_m, double range_m,
                   const GlintBeam* beam = nullptr);

/// I of a right corner across its edge, m^2.
double corner_power_m2(double width_m, double excess_rad, double range_m, double wavelength_m);

}  // namespace ensonify::engine
