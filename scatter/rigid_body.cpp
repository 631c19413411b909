#include <ensonify/scatter/rigid_body.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>

namespace ensonify::scatter {
namespace {

using std::numbers::pi;

constexpr double large_ka = 20.0;  // from here on a body has the cross-section for short waves
constexpr double small_ka = 0.01;  // below this the limit for small ka is exact to rounding

constexpr unsigned most_modes = static_cast<unsigned>(large_ka) + 14;
/// The number of modes that contribute to the sum.
unsigned modes(double ka) { return static_cast<unsigned>(ka) + 14; }

/// Derivatives at x of Bessel functions, for the orders 0 to n - 1. The functions of two orders are
/// computed directly, and the others follow by the recurrence f_(m-1) = (2 m + odd) / x f_m -
/// f_(m+1). It is stable downwards for j, upwards for y. odd: 1 for spherical, 0 for cylindrical
/// functions.
struct Slopes {
  std::array<double, most_modes + 2> of_j{}, of_y{};
  Slopes(double x, unsigned n, double odd, double (*j)(unsigned, double),
         double (*y)(unsigned, double)) {
    std::array<double, most_modes + 2> its_j{}, its_y{};
    its_j[n + 1] = j(n + 1, x), its_j[n] = j(n, x);
    for (unsigned i = n; i > 0; --i) its_j[i - 1] = (2 * i + odd) / x * its_j[i] - its_j[i + 1];
    its_y[0] = y(0, x), its_y[1] = y(1, x);
    for (unsigned i = 1; i <= n; ++i) its_y[i + 1] = (2 * i + odd) / x * its_y[i] - its_y[i - 1];
    for (unsigned i = 0; i < n; ++i) {
      of_j[i] = i / x * its_j[i] - its_j[i + 1];
      of_y[i] = i / x * its_y[i] - its_y[i + 1];
    }
  }
};

double limit_of_sphere(double ka) { return 25.0 / 9.0 * std::pow(ka, 4); }
double limit_of_cylinder(double ka) { return 9.0 * pi / 4.0 * std::pow(ka, 3); }

constexpr double steps_per_ka = 32.0;  // in the tables
double slowly(double limit) { return limit / (1.0 + limit); }

/// 3 j_1(u) / u, also for u near 0.
double form_factor(double u) {
  return u < 0.01 ? 1.0 - 0.1 * u * u : 3.0 * std::sph_bessel(1, u) / u;
}

/// Carlson's integral R_D(x, y, z), by his duplication theorem.
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
  const Slopes slopes(ka, modes(ka), 1.0, std::sph_bessel, std::sph_neumann);
  std::complex<double> sum = 0.0;
  for (unsigned n = 0; n < modes(ka); ++n) {
    const double sign = n % 2 == 0 ? 1.0 : -1.0;
    sum += sign * (2.0 * n + 1.0) * slopes.of_j[n] / std::complex(slopes.of_j[n], slopes.of_y[n]);
  }
  return 4.0 / (ka * ka) * std::norm(sum);
}

double rigid_cylinder_gain(double ka) {
  if (!(ka < large_ka)) return 1.0;
  if (ka < small_ka) return limit_of_cylinder(ka);
  const Slopes slopes(
      ka, modes(ka), 0.0, [](unsigned n, double x) { return std::cyl_bessel_j(double(n), x); },
      [](unsigned n, double x) { return std::cyl_neumann(double(n), x); });
  std::complex<double> sum = 0.0;
  for (unsigned n = 0; n < modes(ka); ++n) {
    const double weight = n == 0 ? 1.0 : n % 2 == 0 ? 2.0 : -2.0;
    sum += weight * slopes.of_j[n] / std::complex(slopes.of_j[n], slopes.of_y[n]);
  }
  return 4.0 / (pi * ka) * std::norm(sum);
}

RigidGains::RigidGains() {
  const auto fill = [](Table& table, double (*limit)(double), double (*gain)(double)) {
    table = {limit, {1.0}};
    for (double ka = 1.0 / steps_per_ka; ka < large_ka; ka += 1.0 / steps_per_ka)
      table.at_steps.push_back(gain(ka) / slowly(limit(ka)));
    table.at_steps.push_back(1.0);
  };
  fill(sphere_, limit_of_sphere, rigid_sphere_gain);
  fill(cylinder_, limit_of_cylinder, rigid_cylinder_gain);
}

double RigidGains::at(const Table& table, double ka) {
  if (!(ka < large_ka)) return 1.0;
  const double place = ka * steps_per_ka;
  const auto step = static_cast<std::size_t>(place);
  const double share = place - static_cast<double>(step);
  return slowly(table.limit(ka)) *
         ((1.0 - share) * table.at_steps[step] + share * table.at_steps[step + 1]);
}

double RigidGains::surface(double k_per_m, double radius_m, double other_radius_m) const {
  const auto [smaller_m, greater_m] = std::minmax(radius_m, other_radius_m);
  const double ka = k_per_m * smaller_m;
  if (!(ka < large_ka)) return 1.0;
  const double evenness = smaller_m / greater_m;
  return std::pow(sphere(ka), evenness) * std::pow(cylinder(ka), 1.0 - evenness);
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
