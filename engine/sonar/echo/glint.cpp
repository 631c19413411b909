#include <ensonify/engine/sonar/echo/glint.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include <ensonify/engine/sonar/instrument/sinc.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector3d;
using std::numbers::inv_sqrtpi, std::numbers::pi;

constexpr double lobe_reach = 3.0;   // half widths of a lobe that count
constexpr double side_lobes = 10.0;  // of a flat part that count
constexpr double rounding_margin = 1.001;

/// C(t) + i S(t): the integral of exp(i pi u^2 / 2) from 0 to t. Near 0 by its power series (7.3.11
/// and 7.3.13 of Abramowitz and Stegun 1964), elsewhere by 7.3.9, 7.3.10, 7.3.32 and 7.3.33: within
/// 0.002.
std::complex<double> fresnel(double t) {
  const double phase = 0.5 * pi * t * t;
  if (std::abs(t) < 1.8) {
    std::complex<double> term = t, sum = t;
    for (int n = 1; n <= 24; ++n) {
      term *= std::complex<double>(0.0, phase / n);
      sum += term / (2.0 * n + 1.0);
    }
    return sum;
  }
  const double x = std::abs(t);
  const double f = (1.0 + 0.926 * x) / (2.0 + 1.792 * x + 3.104 * x * x);
  const double g = 1.0 / (2.0 + 4.142 * x + 3.492 * x * x + 6.670 * x * x * x);
  const double sine = std::sin(phase), cosine = std::cos(phase);
  const std::complex<double> value(0.5 + f * sine - g * cosine, 0.5 - f * cosine - g * sine);
  return t < 0.0 ? -value : value;
}

/// How far a direction of a flat part may be inclined, beyond what its length spans, to have a
/// glint.
double reach_of(double length_m, double bend_rad, double wavelength_m) {
  return bend_rad > 0.0 ? lobe_reach * bend_rad : 0.5 * side_lobes * wavelength_m / length_m;
}

/// I_1 I_2 for an ellipse with the half axes a and b, whose normal is inclined by t and by s in
/// their directions, m^4. It is a unit disc in (p, w) if u = a (c p - d w) and v = b (d p + c w);
/// with (c, d) = (a t, b s) / n the inclination is along p alone: u t + v s = n p, and u^2 + v^2 =
/// A p^2 + 2 B p w + G w^2. With chords across it, p = cos q: |a b integral over q of exp(i k ((A -
/// B^2 / G) p^2 / r - 2 n p)) C sin q dq|^2, C = the integral of exp(i k G (w + p B / G)^2 / r)
/// over w from -sin q to sin q. The integrand is even and periodic in q, so that the midpoint rule
/// is exact once its steps resolve the phase.
double ellipse_power_m4(const MirrorExtent& one, const MirrorExtent& other, double wavelength_m) {
  const double range_m = one.range_m, k = 2.0 * pi / wavelength_m;
  const double a = one.length_m * inv_sqrtpi, b = other.length_m * inv_sqrtpi;
  const double n = std::hypot(a * one.tilt, b * other.tilt);
  const double c = n > 0.0 ? a * one.tilt / n : 1.0, d = n > 0.0 ? b * other.tilt / n : 0.0;
  const double A = a * a * c * c + b * b * d * d, B = (b * b - a * a) * c * d,
               G = a * a * d * d + b * b * c * c;
  const double per_w = 2.0 * std::sqrt(G / (wavelength_m * range_m));
  const int steps = 16 + static_cast<int>(2.0 * k * (std::max(a * a, b * b) / range_m + n));
  std::complex<double> sum = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double q = (i + 0.5) * pi / steps;
    const double p = std::cos(q), half = std::sin(q), off = p * B / G;
    const double phase = k * ((A - B * B / G) * p * p / range_m - 2.0 * n * p);
    sum += half * std::polar(1.0, phase) *
           (fresnel(per_w * (half + off)) + fresnel(per_w * (half - off)));
  }
  return std::norm(a * b / per_w * pi / steps * sum);
}

/// Whether a direction is inclined too far for a glint at that range, by products only. foot_m:
/// from the flat part's middle to the foot of the line of sight.
bool beyond_reach(double foot_m, double length_m, double bend_rad, double range_m2,
                  double wavelength_m) {
  const double off_m = std::abs(foot_m) - 0.5 * length_m;
  const double reach = rounding_margin * reach_of(length_m, bend_rad, wavelength_m);
  return off_m > 0.0 && off_m * off_m > reach * reach * range_m2;
}

/// Where a flat part, or the curved surface that it stands for, faces a sonar, in one direction.
struct Foot {
  double from_middle_m;
  double out_m;  ///< along the normal: facets of a curved surface are chords

  /// foot_m: the foot of the line of sight; distance_m: to the sonar, negative if it sees the back.
  Foot(double foot_m, double length_m, double bend_rad, double arc_m, double distance_m)
      : from_middle_m(std::clamp(foot_m, -0.5 * length_m, 0.5 * length_m)), out_m(0.0) {
    if (bend_rad == 0.0) return;
    // At u the surface is turned by bend u / arc, and the sonar is (foot - u) / distance off the
    // normal of the middle. So facets that share a glint have it at one place. A concave surface
    // may face the sonar nowhere near.
    const double there_m = foot_m * arc_m / (arc_m + bend_rad * distance_m);
    const double most_m = 0.5 * length_m + lobe_reach * std::abs(arc_m);
    from_middle_m = std::isfinite(there_m) ? std::clamp(there_m, -most_m, most_m) : 0.0;
    out_m = bend_rad / arc_m * (0.125 * length_m * length_m - 0.5 * from_middle_m * from_middle_m);
  }
};

}  // namespace

MirrorExtent::MirrorExtent(double its_length_m, double bend_rad, double its_tilt,
                           double its_range_m, double wavelength_m)
    : length_m(its_length_m),
      lobe(bend_rad > 0.0 ? bend_rad : 0.5 * inv_sqrtpi * wavelength_m / its_length_m),
      reach(reach_of(its_length_m, bend_rad, wavelength_m)),
      tilt(its_tilt),
      range_m(its_range_m),
      curved(bend_rad > 0.0) {}

bool MirrorExtent::reaches() const { return std::abs(tilt) < 0.5 * length_m / range_m + reach; }

bool MirrorExtent::is_far(double wavelength_m) const {
  return length_m * length_m < 0.09 * (wavelength_m * range_m);
}

double MirrorExtent::power_m2(double wavelength_m) const {
  const double zone_m2 = wavelength_m * range_m;
  if (curved) {
    const double half = 0.5 * length_m / range_m;
    return 0.25 * zone_m2 * (std::erf((tilt + half) / lobe) - std::erf((tilt - half) / lobe));
  }
  if (is_far(wavelength_m)) {
    const double field_m = length_m * sinc(2.0 * length_m * tilt / wavelength_m);
    return field_m * field_m;
  }
  const double per_m = 2.0 / std::sqrt(zone_m2), middle_m = range_m * tilt;
  return 0.25 * zone_m2 *
         std::norm(fresnel(per_m * (0.5 * length_m - middle_m)) -
                   fresnel(per_m * (-0.5 * length_m - middle_m)));
}

double MirrorExtent::phase_rad(double wavelength_m) const {
  const double zone_m2 = wavelength_m * range_m, middle_m = range_m * tilt;
  const double off_m = std::max(std::abs(middle_m) - 0.5 * length_m, 0.0);  // the nearest place
  const double per_m2 = 2.0 * pi / zone_m2;
  if (is_far(wavelength_m))
    return per_m2 * (middle_m * middle_m - off_m * off_m) +
           (sinc(2.0 * length_m * tilt / wavelength_m) < 0.0 ? pi : 0.0);
  const double per_m = 2.0 / std::sqrt(zone_m2);
  return std::arg(fresnel(per_m * (0.5 * length_m - middle_m)) -
                  fresnel(per_m * (-0.5 * length_m - middle_m))) -
         per_m2 * off_m * off_m;
}

double Mirror::cross_section_m2(double wavelength_m) const {
  const double power_m4 = round ? ellipse_power_m4(one, other, wavelength_m)
                                : one.power_m2(wavelength_m) * other.power_m2(wavelength_m);
  return power_m4 / (wavelength_m * wavelength_m);
}

double Mirror::phase_rad(double wavelength_m) const {
  return one.phase_rad(wavelength_m) + other.phase_rad(wavelength_m);
}

std::optional<Mirror> mirror_of(const FlatPart& flat_part, const Vector3d& away,
                                double wavelength_m) {
  const Vector3d along = flat_part.along.cast<double>(), across = flat_part.across.cast<double>();
  const double length_m = double(flat_part.length_m), width_m = double(flat_part.width_m);
  // The foot of the line of sight, and the place that is most nearly a mirror. Its range counts,
  // which on a long flat part is not that of the middle.
  const double along_m = -away.dot(along), across_m = -away.dot(across);
  const double bend_along_rad = double(flat_part.bend_along_rad);
  const double bend_across_rad = double(flat_part.bend_across_rad);
  // Most are inclined too far even at the range of the middle, which is not nearer.
  const double middle_m2 = away.squaredNorm();
  if (beyond_reach(along_m, length_m, bend_along_rad, middle_m2, wavelength_m) ||
      beyond_reach(across_m, width_m, bend_across_rad, middle_m2, wavelength_m))
    return std::nullopt;
  const Vector3d normal = flat_part.normal.cast<double>();
  const double distance_m = std::copysign(std::sqrt(middle_m2), -away.dot(normal));
  const Foot along_foot(along_m, length_m, bend_along_rad, double(flat_part.arc_along_m),
                        distance_m);
  const Foot across_foot(across_m, width_m, bend_across_rad, double(flat_part.arc_across_m),
                         distance_m);
  const Vector3d offset = along_foot.from_middle_m * along + across_foot.from_middle_m * across +
                          (along_foot.out_m + across_foot.out_m) * normal;
  const double range_m = (away + offset).norm();
  const MirrorExtent one(length_m, bend_along_rad, along_m / range_m, range_m, wavelength_m);
  if (!one.reaches()) return std::nullopt;
  const MirrorExtent other(width_m, bend_across_rad, across_m / range_m, range_m, wavelength_m);
  if (!other.reaches()) return std::nullopt;
  return Mirror{offset, one, other, flat_part.round && !one.curved && !other.curved};
}

double glint_radius_m(const FlatPartBlock& block) {
  return block.radius_m + lobe_reach * block.max_arc_m;
}

double glint_reach(const FlatPartBlock& block, double wavelength_m) {
  const double curved = lobe_reach * block.max_bend_rad;
  const double plane = reach_of(block.shortest_plane_m, 0.0, wavelength_m);
  return rounding_margin * std::sqrt(curved * curved + 2.0 * plane * plane);
}

double corner_power_m2(double width_m, double excess_rad, double range_m, double wavelength_m) {
  const double zone_m2 = wavelength_m * range_m;
  const double per_m = 2.0 / std::sqrt(zone_m2), off_m = range_m * excess_rad;
  return zone_m2 * std::norm(fresnel(per_m * (0.5 * width_m + off_m)) - fresnel(per_m * off_m));
}

}  // namespace ensonify::engine
