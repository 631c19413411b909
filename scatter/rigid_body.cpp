#include <ensonify/scatter/rigid_body.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>

namespace ensonify::scatter {
namespace {

using std::numbers::pi;

constexpr double large_ka = 20.0;  // from which on a body has the cross-section of short waves
constexpr double small_ka = 0.01;  // below which the first terms are exact to rounding

/// As many as count.
unsigned modes(double ka) { return static_cast<unsigned>(ka) + 14; }

double limit_of_sphere(double ka) { return 25.0 / 9.0 * std::pow(ka, 4); }

/// 3 j_1(u) / u.
double form_factor(double u) {
  return u < 0.01 ? 1.0 - 0.1 * u * u : 3.0 * std::sph_bessel(1, u) / u;
}

/// Carlson's integral, by duplication.
double carlson_d(double x, double y, double z) {
  constexpr int turns = 16;
  double sum = 0.0, share = 1.0;
  for (int i = 0; i < turns; ++i) {
    const double l = std::sqrt(x * y) + std::sqrt(y * z) + std::sqrt(z * x);
    sum += share / (std::sqrt(z) * (z + l));
    share *= 0.25;
    x = 0.25 * (x + l), y = 0.25 * (y + l), z = 0.25 * (z + l);
  }
  return 3.0 * sum + share * std::pow(0.2 * (x + y + 3.0 * z), -1.5);
}

}  // namespace

double rigid_sphere_gain(double ka) {
  if (!(ka < large_ka)) return 1.0;
  if (ka < small_ka) return limit_of_sphere(ka);
  std::complex<double> sum = 0.0;
  for (unsigned n = 0; n < modes(ka); ++n) {
    // f' = n f / x - f of the next order.
    const auto slope = [&](auto f) { return n / ka * f(n, ka) - f(n + 1, ka); };
    const double of_j = slope([](unsigned i, double x) { return std::sph_bessel(i, x); });
    const double of_y = slope([](unsigned i, double x) { return std::sph_neumann(i, x); });
    const double sign = n % 2 == 0 ? 1.0 : -1.0;
    sum += sign * (2.0 * n + 1.0) * of_j / std::complex(of_j, of_y);
  }
  return 4.0 / (ka * ka) * std::norm(sum);
}

double rigid_cylinder_gain(double ka) {
  if (!(ka < large_ka)) return 1.0;
  if (ka < small_ka) return 9.0 * pi / 4.0 * std::pow(ka, 3);
  std::complex<double> sum = 0.0;
  for (unsigned n = 0; n < modes(ka); ++n) {
    const auto slope = [&](auto f) { return n / ka * f(n, ka) - f(n + 1.0, ka); };
    const double of_j = slope([](double i, double x) { return std::cyl_bessel_j(i, x); });
    const double of_y = slope([](double i, double x) { return std::cyl_neumann(i, x); });
    const double weight = n == 0 ? 1.0 : n % 2 == 0 ? 2.0 : -2.0;
    sum += weight * of_j / std::complex(of_j, of_y);
  }
  return 4.0 / (pi * ka) * std::norm(sum);
}

double rigid_surface_gain(double k_per_m, double radius_m, double other_radius_m) {
  const auto [smaller_m, greater_m] = std::minmax(radius_m, other_radius_m);
  const double ka = k_per_m * smaller_m;
  if (!(ka < large_ka)) return 1.0;
  const double evenness = smaller_m / greater_m;
  return std::pow(rigid_sphere_gain(ka), evenness) *
         std::pow(rigid_cylinder_gain(ka), 1.0 - evenness);
}

std::array<double, 3> ellipsoid_shares(const std::array<double, 3>& half_axes_m) {
  const auto& [a, b, c] = half_axes_m;
  const double third = a * b * c / 3.0;
  return {third * carlson_d(b * b, c * c, a * a), third * carlson_d(c * c, a * a, b * b),
          third * carlson_d(a * a, b * b, c * c)};
}

double small_body_cross_section(const RigidBody& body, const std::array<double, 3>& direction,
                                double k_per_m) {
  const std::array<double, 3> shares = ellipsoid_shares(body.half_axes_m);
  double moved = 1.0, depth_m2 = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double of_axis = direction[i] * direction[i];
    moved += of_axis / (1.0 - shares[i]);
    depth_m2 += of_axis * body.half_axes_m[i] * body.half_axes_m[i];
  }
  const double ka = k_per_m * std::cbrt(0.75 / pi * body.volume_m3);
  const double limit_m = k_per_m * k_per_m * body.volume_m3 / (4.0 * pi) * moved;
  const double form = form_factor(2.0 * k_per_m * std::sqrt(depth_m2)) / form_factor(2.0 * ka);
  return std::pow(limit_m * form, 2) * rigid_sphere_gain(ka) / limit_of_sphere(ka);
}

}  // namespace ensonify::scatter
