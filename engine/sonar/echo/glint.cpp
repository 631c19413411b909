#include <ensonify/engine/sonar/echo/glint.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include <ensonify/engine/base/made_once.h>
#include <ensonify/engine/sonar/echo/glint_in_beam.h>
#include <ensonify/engine/sonar/instrument/sinc.h>
#include <ensonify/scatter/rigid_body.h>

namespace ensonify::engine {
namespace {

scatter::RigidGains made_rigid_gains() { return {}; }
const scatter::RigidGains& rigid_gains() { return made_once<made_rigid_gains>(); }

using Eigen::Vector3d;
using std::numbers::inv_sqrtpi, std::numbers::pi;

constexpr double side_lobes = 10.0;  // of a straight line that count
constexpr double zones = 1.5;        // a line counts up to sqrt(zones lambda r) beyond its end
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

/// How far a straight line may be inclined, beyond what its length spans, to have a glint: some
/// side lobes, a Fresnel zone, or the array's length.
double reach_of(double length_m, double wavelength_m, double range_m, double array_m) {
  return std::max({0.5 * side_lobes * wavelength_m / length_m,
                   std::sqrt(zones * wavelength_m / range_m), array_m / range_m});
}

double array_length_m(const GlintBeam* beam) { return beam ? beam->array_m : 0.0; }

/// I_1 I_2 for an ellipse with the half axes a and b, whose normal is inclined by t and by s in
/// their directions, m^4. With u = a (c p - d w) and v = b (d p + c w), the ellipse is a unit disc
/// in (p, w). With (c, d) = (a t, b s) / n the inclination is along p alone: u t + v s = n p, and
/// u^2 + v^2 = A p^2 + 2 B p w + G w^2. The disc is divided into chords at p = cos q. Then I_1 I_2
/// is |a b integral over q of exp(i k ((A - B^2 / G) p^2 / r - 2 n p)) C sin q dq|^2, where C is
/// the integral of exp(i k G (w + p B / G)^2 / r) over w from -sin q to sin q. The integrand is
/// even and periodic in q, so that the midpoint rule is exact once its steps resolve the phase.
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
bool beyond_reach(double foot_m, double length_m, double range_m2, double wavelength_m,
                  double array_m) {
  const double off_m = std::abs(foot_m) - 0.5 * length_m, off_m2 = off_m * off_m;
  const double lobes = 0.5 * side_lobes * wavelength_m / length_m, zone_m = zones * wavelength_m;
  return off_m > rounding_margin * array_m && off_m2 > rounding_margin * lobes * lobes * range_m2 &&
         off_m2 * off_m2 > rounding_margin * zone_m * zone_m * range_m2;
}

std::optional<Mirror> flat_mirror(const FlatPart& flat_part, const Vector3d& away,
                                  double wavelength_m, const GlintBeam* beam) {
  const Vector3d along = flat_part.along.cast<double>(), across = flat_part.across.cast<double>();
  const double length_m = double(flat_part.length_m), width_m = double(flat_part.width_m);
  const double array_m = array_length_m(beam);
  // The foot of the line of sight, and the place of the flat part that is nearest to it. The range
  // of this place counts; on a long flat part it differs from the range of the middle.
  const double along_m = -away.dot(along), across_m = -away.dot(across);
  // Most flat parts are inclined too far already at the range of their middle, which is not less.
  const double middle_m2 = away.squaredNorm();
  if (beyond_reach(along_m, length_m, middle_m2, wavelength_m, array_m) ||
      beyond_reach(across_m, width_m, middle_m2, wavelength_m, array_m))
    return std::nullopt;
  const auto within = [&](double share) -> Vector3d {
    return std::clamp(along_m, -share * length_m, share * length_m) * along +
           std::clamp(across_m, -share * width_m, share * width_m) * across;
  };
  const Vector3d offset = within(0.5);
  const double range_m = (away + offset).norm();
  double beam_rad = 0.0;
  if (beam) {
    const FlatPartInBeam in_beam(flat_part, away, range_m, wavelength_m, *beam);
    if (in_beam.counts()) return in_beam.mirror();
    if (flat_part.piece) beam_rad = in_beam.beam_rad(offset);
  }
  const MirrorExtent one{length_m, along_m / range_m, range_m};
  const MirrorExtent other{width_m, across_m / range_m, range_m};
  if (!one.reaches(wavelength_m) || !other.reaches(wavelength_m)) return std::nullopt;
  const double power_m4 = flat_part.round
                              ? ellipse_power_m4(one, other, wavelength_m)
                              : one.power_m2(wavelength_m) * other.power_m2(wavelength_m);
  return Mirror{.offset = offset,
                .inside = within(flat_part.round ? 0.3 : 0.4),
                .cross_section_m2 = power_m4 / (wavelength_m * wavelength_m),
                .phase_rad = flat_part.piece ? one.phase_rad(wavelength_m) +
                                                   other.phase_rad(wavelength_m) + beam_rad
                                             : 0.0};
}

/// A corner of a facet, with the normal on the side that the sonar sees, and where the sonar
/// appears to be from there.
struct Corner {
  Vector3d place, normal, sonar;
  double per_m2;  // Gaussian curvature
};
using Corners = std::array<Corner, 4>;

/// A place of the surface that a facet stands for, by the shares of corners in it.
Vector3d place_on(std::span<const Corner> corners, std::span<const double> shares) {
  Vector3d place = Vector3d::Zero(), normal = Vector3d::Zero();
  double out_m = 0.0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    place += shares[i] * corners[i].place;
    normal += shares[i] * corners[i].normal;
    for (std::size_t k = 0; k < i; ++k)
      out_m += 0.5 * shares[i] * shares[k] *
               (corners[i].normal - corners[k].normal).dot(corners[i].place - corners[k].place);
  }
  return place + out_m * normal.normalized();
}

/// Whether all normals are turned to one side of the direction to the sonar, by more than this
/// direction changes over the facet. Then the facet has no glint. This holds for most facets.
bool turned_away(std::span<const Corner, 3> corners) {
  const Vector3d way = corners[0].sonar - corners[0].place;
  const double range_m = way.norm();
  const Vector3d to_sonar = way / range_m;
  const Vector3d side = corners[0].normal - corners[0].normal.dot(to_sonar) * to_sonar;
  for (const Corner& corner : corners.subspan<1>()) {
    const double turned_m = range_m * side.dot(corner.normal);
    const double change_m2 = 4.0 * (corner.sonar - corner.place - way).squaredNorm();
    if (!(turned_m > 0.0 && turned_m * turned_m > change_m2 * side.squaredNorm())) return false;
  }
  return true;
}

/// The smaller radius of curvature of a surface with this Gaussian curvature. How the normal turns
/// over the facet gives the mean curvature.
double smaller_radius_m(std::span<const Corner, 3> corners, double per_m2) {
  const Vector3d one = corners[1].place - corners[0].place,
                 other = corners[2].place - corners[0].place;
  const Vector3d area = one.cross(other);  // twice
  const Vector3d turned = (corners[1].normal - corners[0].normal).cross(other) +
                          one.cross(corners[2].normal - corners[0].normal);
  const double mean_per_m = 0.5 * std::abs(turned.dot(area)) / area.squaredNorm();
  return 1.0 / (mean_per_m + std::sqrt(std::max(mean_per_m * mean_per_m - per_m2, 0.0)));
}

std::optional<Mirror> triangle_mirror(std::span<const Corner, 3> corners, const Vector3d& middle,
                                      double wavelength_m) {
  if (turned_away(corners)) return std::nullopt;
  std::array<Vector3d, 3> to_sonar, turned;
  for (std::size_t i = 0; i < 3; ++i) {
    to_sonar[i] = (corners[i].sonar - corners[i].place).normalized();
    turned[i] = corners[i].normal - to_sonar[i];
  }
  // Each share belongs to a side. In the facet beyond that side it has the opposite sign.
  std::array<double, 3> shares;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    shares[i] = turned[j].cross(turned[k]).dot(to_sonar[j] + to_sonar[k]);
  }
  const double sum = shares[0] + shares[1] + shares[2];  // four times the solid angle
  for (double& share : shares) {
    share /= sum;
    if (!(share >= 0.0)) return std::nullopt;
  }
  const Vector3d place = place_on(corners, shares), back = corners[0].sonar - place;
  const double range_m = back.norm();
  const auto of = [&](Vector3d Corner::*what) {
    return (corners[1].*what - corners[0].*what).cross(corners[2].*what - corners[0].*what).eval();
  };
  const Vector3d area = of(&Corner::place);  // twice
  // W / A, and by how much the curvature at the place exceeds the facet's mean.
  const double mean_per_m2 = 0.5 * range_m * sum / area.dot(back);
  const double of_surface_per_m2 = of(&Corner::normal).dot(area) / area.squaredNorm();
  double per_m2 = 0.0;
  for (std::size_t i = 0; i < 3; ++i) per_m2 += shares[i] * corners[i].per_m2;
  const double more_per_m2 = per_m2 - of_surface_per_m2;
  const double turn_per_m2 =
      std::clamp(1.0 + more_per_m2 / mean_per_m2, 0.5, 2.0) * std::abs(mean_per_m2);
  const double radius_m = smaller_radius_m(corners, of_surface_per_m2);
  const double other_radius_m = 1.0 / std::max(std::abs(of_surface_per_m2) * radius_m, 1e-12);
  return Mirror{
      .offset = place - middle,
      .inside = place - middle,
      .cross_section_m2 = rigid_gains().surface(2.0 * pi / wavelength_m, radius_m, other_radius_m) *
                          0.25 / std::max(turn_per_m2, 1.0 / (range_m * range_m)),
      .phase_rad = 0.0};
}

/// |integral of the root of the width exp(i k (z - r t)^2 / r) dz|^2 where the width is not the
/// same all over a line, m^3: by the midpoint rule.
double tapered_power_m3(const MirrorExtent& line, double width_m, double other_width_m,
                        double wavelength_m) {
  const double k = 2.0 * pi / wavelength_m, half_m = 0.5 * line.length_m;
  const double foot_m = line.range_m * line.tilt;
  const double phase_rad = k / line.range_m * 2.0 * half_m * (half_m + std::abs(foot_m));
  const int steps = 32 + static_cast<int>(2.0 * phase_rad);
  std::complex<double> sum = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double share = (i + 0.5) / steps;
    const double off_m = line.length_m * (share - 0.5) - foot_m;
    sum += std::polar(std::sqrt(width_m + share * (other_width_m - width_m)),
                      k / line.range_m * off_m * off_m);
  }
  return std::norm(line.length_m / steps * sum);
}

std::optional<Mirror> strip_mirror(const Corners& corners, const Vector3d& middle,
                                   double wavelength_m, const GlintBeam* beam) {
  // The sonar's distance from the plane of a side, positive if sonar and strip are on one side of
  // it.
  const auto from_plane_m = [&](std::size_t side) {
    const Vector3d& begin = corners[side].place;
    const Vector3d normal =
        (corners[side + 1].place - begin).cross(corners[side].normal).normalized();
    const double inwards =
        normal.dot(corners[2 - side].place + corners[3 - side].place - 2.0 * begin);
    return std::copysign(1.0, inwards) * normal.dot(corners[side].sonar - begin);
  };
  const double one_m = from_plane_m(0), other_m = from_plane_m(2), both_m = one_m + other_m;
  const double share = one_m / both_m;
  if (!(share >= 0.0 && share <= 1.0)) return std::nullopt;
  const auto on_line = [&](std::size_t end) {
    return place_on(std::array{corners[end], corners[2 + end]}, std::array{1.0 - share, share});
  };
  const Vector3d& sonar = corners[0].sonar;
  const Vector3d begin = on_line(0), end = on_line(1);
  const double length_m = (end - begin).norm();
  const Vector3d along = (end - begin) / length_m;
  const auto width_m = [&](std::size_t at) {
    return (corners[2 + at].place - corners[at].place).cross(along).norm();
  };
  const double first_m = width_m(0), last_m = width_m(1);
  const Vector3d line_middle = 0.5 * (begin + end);
  const auto line =
      glint_of_line(line_middle - sonar, along, length_m, first_m, last_m, wavelength_m, beam);
  if (!line) return std::nullopt;
  const Vector3d place = line_middle + line->place_m * along;
  const double wider_m = std::max(first_m, last_m), most_m = std::max(std::abs(both_m), wider_m);
  // Planes that are w apart on a body of the radius a are w (a + r) / a apart at a sonar at the
  // range r.
  const double widest_radius_m = line->range_m * std::min(wider_m / (most_m - wider_m), 1.0);
  const double radius_m = 0.5 * (first_m + last_m) / wider_m * widest_radius_m;
  const double per_m = rigid_gains().cylinder(2.0 * pi / wavelength_m * radius_m) * line->range_m /
                       (2.0 * wavelength_m * most_m);
  return Mirror{.offset = place - middle,
                .inside = place - middle,
                .cross_section_m2 = per_m * line->power_m3,
                .phase_rad = 0.0,
                .in_beam = line->in_beam,
                .line = MirrorLine{.middle = line_middle - middle,
                                   .away = line_middle - sonar,
                                   .along = along,
                                   .length_m = length_m,
                                   .width = per_m * first_m,
                                   .other_width = per_m * last_m,
                                   .radius_m = radius_m}};
}

}  // namespace

bool MirrorExtent::reaches(double wavelength_m, double array_m) const {
  return std::abs(tilt) <
         0.5 * length_m / range_m + reach_of(length_m, wavelength_m, range_m, array_m);
}

std::complex<double> MirrorExtent::field_m(double wavelength_m) const {
  const double zone_m2 = wavelength_m * range_m, middle_m = range_m * tilt;
  if (length_m * length_m < 0.09 * zone_m2)  // far enough for the sinc of a plane wave
    return std::polar(1.0, 2.0 * pi / zone_m2 * middle_m * middle_m) *
           (length_m * sinc(2.0 * length_m * tilt / wavelength_m));
  const double per_m = 2.0 / std::sqrt(zone_m2);
  return 0.5 * std::sqrt(zone_m2) *
         (fresnel(per_m * (0.5 * length_m - middle_m)) -
          fresnel(per_m * (-0.5 * length_m - middle_m)));
}

double MirrorExtent::phase_rad(double wavelength_m) const {
  const double off_m = std::max(range_m * std::abs(tilt) - 0.5 * length_m, 0.0);
  return std::arg(field_m(wavelength_m)) - 2.0 * pi / (wavelength_m * range_m) * off_m * off_m;
}

std::optional<LineGlint> glint_of_line(const Vector3d& middle, const Vector3d& along,
                                       double length_m, double width_m, double other_width_m,
                                       double wavelength_m, const GlintBeam* beam) {
  const double foot_m = -middle.dot(along), half_m = 0.5 * length_m;
  const double place_m = std::clamp(foot_m, -half_m, half_m);
  const double range_m = (middle + place_m * along).norm();
  if (beam)
    if (const BeamOnLine in_beam(middle, along, 0.5 * length_m, range_m, wavelength_m, *beam);
        in_beam.counts())
      return line_glint_in_beam(in_beam, middle, along, width_m, other_width_m);
  const MirrorExtent line{length_m, foot_m / range_m, range_m};
  if (!line.reaches(wavelength_m)) return std::nullopt;
  constexpr double same = 1e-3;
  const double power_m3 =
      std::abs(width_m - other_width_m) < same * std::max(width_m, other_width_m)
          ? 0.5 * (width_m + other_width_m) * line.power_m2(wavelength_m)
          : tapered_power_m3(line, width_m, other_width_m, wavelength_m);
  return LineGlint{place_m, range_m, power_m3, false};
}

std::optional<Mirror> mirror_of(const FlatPart& flat_part, const CurvedFacets& curved,
                                const Vector3d& away, double wavelength_m,
                                const SonarFrom& sonar_from, const GlintBeam* beam) {
  if (flat_part.facets == 0) return flat_mirror(flat_part, away, wavelength_m, beam);
  // A little beside the sonar's place, because exactly between two equal facets neither has the
  // glint.
  constexpr double beside = 1e-6;
  const Vector3d off = beside * away.norm() * Vector3d(0.36, 0.48, 0.8);
  const Vector3d sonar = flat_part.middle - away + off;
  const double front = away.dot(flat_part.normal.cast<double>()) < 0.0 ? 1.0 : -1.0;
  for (const CurvedFacet& facet : curved.of(flat_part)) {
    Corners corners;
    for (std::size_t i = 0; i < 4; ++i) {
      const FacetCorner& corner = curved.corners[facet.corners[i]];
      corners[i] = {corner.place, front * corner.normal.cast<double>(), sonar,
                    double(corner.per_m2)};
    }
    if (sonar_from) {
      // sonar_from() is slow, and turns the direction to the sonar only a little over a facet.
      constexpr double nearly_facing = 0.8;
      const auto faces_sonar = [](const Corner& corner) {
        const Vector3d to_sonar = corner.sonar - corner.place;
        return to_sonar.dot(corner.normal) > nearly_facing * to_sonar.norm();
      };
      if (!facet.strip && std::ranges::none_of(corners, faces_sonar)) continue;
      for (std::size_t i = 0; i < 4; ++i) {
        Vector3d place = corners[i].place;
        if (facet.strip) {  // the nearest place of its side
          const Vector3d side = corners[i ^ 1].place - place;
          place += std::clamp((sonar - place).dot(side) / side.squaredNorm(), 0.0, 1.0) * side;
        }
        corners[i].sonar = sonar_from(place) + off;
      }
    }
    if (std::optional<Mirror> mirror =
            facet.strip
                ? strip_mirror(corners, flat_part.middle, wavelength_m, beam)
                : triangle_mirror(std::span(corners).first<3>(), flat_part.middle, wavelength_m))
      return mirror;
  }
  return std::nullopt;
}

double glint_reach(const FlatPartBlock& block, double wavelength_m, double range_m,
                   const GlintBeam* beam) {
  if (block.shortest_straight_m == std::numeric_limits<double>::infinity()) return 0.0;
  return rounding_margin * std::sqrt(2.0) *
         reach_of(block.shortest_straight_m, wavelength_m, range_m, array_length_m(beam));
}

double corner_power_m2(double width_m, double excess_rad, double range_m, double wavelength_m) {
  const double zone_m2 = wavelength_m * range_m;
  const double per_m = 2.0 / std::sqrt(zone_m2), off_m = range_m * excess_rad;
  return zone_m2 * std::norm(fresnel(per_m * (0.5 * width_m + off_m)) - fresnel(per_m * off_m));
}

}  // namespace ensonify::engine
