#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <vector>

#include "support/catch.h"

#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/rigid_body.h>

using namespace ensonify::scatter;
using std::numbers::pi;

namespace {

/// Bessel functions of whole orders by recurrence: the first kind downwards, the second kind
/// upwards. half: spherical Bessel functions.
struct Orders {
  std::vector<double> j, y;
};
Orders orders(double x, bool half, std::size_t most) {
  const double step = half ? 1.0 : 0.0;
  const std::size_t start = most + 40;
  std::vector<double> j(start + 2, 0.0);
  j[start] = 1e-200;
  for (std::size_t n = start; n > 0; --n)
    j[n - 1] = (2.0 * static_cast<double>(n) + step) / x * j[n] - j[n + 1];
  Orders all{j, std::vector<double>(most + 2)};
  double scale = std::sin(x) / x / j[0];
  if (!half) {  // 1 = J0 + 2 J2 + 2 J4 ...
    double sum = j[0];
    for (std::size_t n = 2; n <= start; n += 2) sum += 2.0 * j[n];
    scale = 1.0 / sum;
  }
  for (double& value : all.j) value *= scale;
  if (half) {
    all.y[0] = -std::cos(x) / x;
    all.y[1] = -std::cos(x) / (x * x) - std::sin(x) / x;
  } else {  // Neumann's series, and Wronski's determinant
    double series = 0.0;
    for (std::size_t n = 1; 2 * n <= start; ++n)
      series += (n % 2 == 0 ? 1.0 : -1.0) * all.j[2 * n] / static_cast<double>(n);
    all.y[0] = 2.0 / pi * (std::log(0.5 * x) + std::numbers::egamma) * all.j[0] - 4.0 / pi * series;
    all.y[1] = (all.j[1] * all.y[0] - 2.0 / (pi * x)) / all.j[0];
  }
  for (std::size_t n = 1; n <= most; ++n)
    all.y[n + 1] = (2.0 * static_cast<double>(n) + step) / x * all.y[n] - all.y[n - 1];
  return all;
}

/// The sum over modes with the weight of each.
template <class Weight>
double sum_of_modes(double x, bool half, const Weight& weight) {
  const auto most = static_cast<std::size_t>(x) + 14;
  const Orders of = orders(x, half, most);
  std::complex<double> sum = 0.0;
  for (std::size_t n = 0; n < most; ++n) {
    const auto slope = [&](const std::vector<double>& f) {
      return static_cast<double>(n) / x * f[n] - f[n + 1];
    };
    sum += (n % 2 == 0 ? 1.0 : -1.0) * weight(n) * slope(of.j) /
           std::complex(slope(of.j), slope(of.y));
  }
  return std::norm(sum);
}

double sphere(double ka) {
  return 4.0 / (ka * ka) *
         sum_of_modes(ka, true, [](std::size_t n) { return 2.0 * static_cast<double>(n) + 1.0; });
}

double cylinder(double ka) {
  return 4.0 / (pi * ka) *
         sum_of_modes(ka, false, [](std::size_t n) { return n == 0 ? 1.0 : 2.0; });
}

}  // namespace

TEST_CASE("rigid spheres and cylinders have the sums over their modes, and Rayleigh's limits") {
  for (const double ka : {0.02, 0.1, 0.3, 0.7, 1.0, 1.5, 2.0, 3.1, 5.0, 8.0, 12.7, 19.9}) {
    CAPTURE(ka);
    CHECK(rigid_sphere_gain(ka) == Approx(sphere(ka)).epsilon(1e-6));
    CHECK(rigid_cylinder_gain(ka) == Approx(cylinder(ka)).epsilon(1e-6));
  }
  CHECK(rigid_sphere_gain(0.02) == Approx(25.0 / 9.0 * std::pow(0.02, 4)).epsilon(0.002));
  CHECK(rigid_cylinder_gain(0.02) == Approx(9.0 * pi / 4.0 * std::pow(0.02, 3)).epsilon(0.002));
  CHECK(rigid_sphere_gain(1e-5) == Approx(25.0 / 9.0 * 1e-20));
  // Short waves.
  for (double ka = 20.0; ka < 50.0; ka *= 1.01) {
    CHECK(std::abs(to_db(sphere(ka))) < 0.25);
    CHECK(std::abs(to_db(cylinder(ka))) < 0.1);
  }
  CHECK(rigid_sphere_gain(20.0) == 1.0);
  CHECK(rigid_cylinder_gain(1e6) == 1.0);
}

TEST_CASE("a rigid surface between a sphere's and a cylinder's has what lies between them") {
  const RigidGains gains;
  CHECK(gains.surface(2.0, 0.3, 0.3) == Approx(gains.sphere(0.6)));
  CHECK(gains.surface(2.0, 0.3, 1e9) == Approx(gains.cylinder(0.6)));
  CHECK(gains.surface(2.0, 1e9, 0.3) == Approx(gains.cylinder(0.6)));
  CHECK(gains.surface(2.0, 0.3, 0.6) == Approx(std::sqrt(gains.sphere(0.6) * gains.cylinder(0.6))));
}

TEST_CASE("an ellipsoid's shares are a third for a sphere, and those of spheroids") {
  const auto sphere_shares = ellipsoid_shares({0.2, 0.2, 0.2});
  for (const double share : sphere_shares) CHECK(share == Approx(1.0 / 3.0));
  const auto needle = ellipsoid_shares({3.0, 1.0, 1.0});
  const double e2 = 8.0 / 9.0, e = std::sqrt(e2);
  CHECK(needle[0] == Approx((1.0 - e2) / e2 * (std::atanh(e) / e - 1.0)));
  CHECK(needle[0] + needle[1] + needle[2] == Approx(1.0));
  // A disc: the fluid that moves with it is 8 a^3 / 3.
  const double thickness = 1e-4, volume = 4.0 / 3.0 * pi * thickness;
  CHECK(volume / (1.0 - ellipsoid_shares({1.0, 1.0, thickness})[2]) ==
        Approx(8.0 / 3.0).epsilon(1e-3));
}

TEST_CASE("a small sphere has its modes, other small bodies Rayleigh's limit") {
  const double volume = 4.0 / 3.0 * pi;
  for (const double ka : {0.01, 0.3, 1.0, 2.0})
    CHECK(small_body_cross_section({volume, {1.0, 1.0, 1.0}}, {0.6, 0.0, 0.8}, ka) ==
          Approx(0.25 * sphere(ka)).epsilon(1e-6));
  const RigidBody needle{3.0 * volume, {3.0, 1.0, 1.0}};
  const double k = 0.01, limit = std::pow(k * k * needle.volume_m3 / (4.0 * pi), 2);
  const auto shares = ellipsoid_shares(needle.half_axes_m);
  CHECK(small_body_cross_section(needle, {1.0, 0.0, 0.0}, k) ==
        Approx(limit * std::pow(1.0 + 1.0 / (1.0 - shares[0]), 2)).epsilon(0.002));
  CHECK(small_body_cross_section(needle, {0.0, 1.0, 0.0}, k) ==
        Approx(limit * std::pow(1.0 + 1.0 / (1.0 - shares[1]), 2)).epsilon(0.002));
}

TEST_CASE("the tables of rigid bodies are within 0.02 dB of the sums over modes") {
  const RigidGains gains;
  for (double ka = 0.003; ka < 19.99; ka *= 1.0173) {
    CAPTURE(ka);
    CHECK(to_db(gains.sphere(ka) / rigid_sphere_gain(ka)) == Approx(0.0).margin(0.02));
    CHECK(to_db(gains.cylinder(ka) / rigid_cylinder_gain(ka)) == Approx(0.0).margin(0.02));
  }
  for (const double ka : {0.0, 20.0, 1e300}) {
    CHECK(gains.sphere(ka) == (ka > 0.0 ? 1.0 : 0.0));
    CHECK(gains.cylinder(ka) == (ka > 0.0 ? 1.0 : 0.0));
  }
}
