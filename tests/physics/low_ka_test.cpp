// Smooth bodies that are not large against the wavelength, against sums over modes and Rayleigh's
// limit, which are written out again here.

#include <cmath>
#include <complex>
#include <numbers>
#include <tuple>
#include <utility>
#include <vector>

#include "physics/body_in_water.h"
#include "support/catch.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/seafloor/objects/solids.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;
using std::numbers::pi;

namespace {

/// A mode's part b = f'(x) / (f' + i g')(x) of functions of the first and second kind, whose slopes
/// follow by differences.
template <class First, class Second>
std::complex<double> part(const First& first, const Second& second, double x) {
  const double step = 1e-4 * x;
  const auto slope = [&](const auto& f) {
    return (8.0 * (f(x + step) - f(x - step)) - (f(x + 2 * step) - f(x - 2 * step))) / (12 * step);
  };
  const double of_first = slope(first), of_second = slope(second);
  return of_first / std::complex(of_first, of_second);
}

/// The target strength of a rigid sphere, divided by its radius squared.
double sphere_db(double ka) {
  std::complex<double> sum = 0.0;
  for (unsigned n = 0; n < static_cast<unsigned>(ka) + 8; ++n)
    sum += std::pow(-1.0, n) * (2.0 * n + 1.0) *
           part([&](double x) { return std::sph_bessel(n, x); },
                [&](double x) { return std::sph_neumann(n, x); }, ka);
  return scatter::to_db(std::norm(sum) / (ka * ka));
}

/// The target strength of a rigid cylinder that is seen across its axis, divided by its length
/// squared.
double rod_db(double ka) {
  std::complex<double> sum = 0.0;
  for (unsigned n = 0; n < static_cast<unsigned>(ka) + 8; ++n)
    sum += std::pow(-1.0, n) * (n == 0 ? 1.0 : 2.0) *
           part([&](double x) { return std::cyl_bessel_j(double(n), x); },
                [&](double x) { return std::cyl_neumann(double(n), x); }, ka);
  return scatter::to_db(std::norm(sum) / (pi * pi));
}

constexpr double low_hz = 20e3, long_wave_m = 1500.0 / low_hz, k_per_m = 2.0 * pi / long_wave_m,
                 cylinder_m = 30.0;

double smooth_db(const refine::TriangleMesh& mesh, double turned_rad = 0.0) {
  const Sonar sonar = wide_sonar(cylinder_m + 2.0, low_hz);
  return target_strength_db(echo_of({mesh, nothing, 1.0, turned_rad}, sonar, cylinder_m), sonar);
}

refine::TriangleMesh ellipsoid(double long_m, double short_m) {
  Solids ball;
  ball.ball(Eigen::Vector3d::Zero(), 1.0, 3);
  for (Eigen::Vector3f& place : ball.mesh.positions)
    place = place.cwiseProduct(Eigen::Vector3d(short_m, long_m, short_m).cast<float>());
  return ball.mesh;
}

}  // namespace

TEST_CASE("a smooth sphere of any ka has the echo of its modes") {
  for (const double ka : {0.1, 0.2094, 0.5, 0.9, 1.3, 1.9, 2.1, 3.0, 5.0, 9.0, 18.0, 22.0}) {
    const double radius_m = ka / k_per_m;
    ShapeSize size;
    size.diameter_m = 2.0 * radius_m;
    CAPTURE(ka);
    CHECK(smooth_db(body("sphere", size)) ==
          Approx(sphere_db(ka) + scatter::to_db(radius_m * radius_m)).margin(0.4));
  }
  // Rayleigh's limit: (25 / 36) (ka)^4.
  CHECK(sphere_db(0.1) == Approx(scatter::to_db(25.0 / 36.0 * 1e-4)).margin(0.1));
}

TEST_CASE("a smooth rod of any ka has the echo of its modes") {
  for (const double ka : {0.1, 0.2094, 0.5, 0.9, 1.3, 1.9, 2.1, 3.0, 5.0, 9.0, 18.0, 22.0}) {
    ShapeSize size;
    size.diameter_m = 2.0 * ka / k_per_m;
    size.length_m = 0.6;
    CAPTURE(ka);
    // Nearer than L^2 / lambda, the waves' curvature counts: as for a thick cylinder.
    const double radius_m = 0.5 * size.diameter_m.value();
    const double near_db = cylinder_db(radius_m, 0.6, cylinder_m - radius_m, long_wave_m) -
                           scatter::to_db(0.5 * radius_m / long_wave_m);
    CHECK(smooth_db(body("cylinder", size)) == Approx(rod_db(ka) + near_db).margin(0.4));
  }
}

TEST_CASE("far below the wavelength an ellipsoid has Rayleigh's limit, from every side") {
  // Lamb's added masses of a prolate spheroid in closed form: along the axis (L_1) and across.
  constexpr double a = 0.0024, b = 0.0008, volume_m3 = 4.0 / 3.0 * pi * a * b * b;
  const double e2 = 1.0 - b * b / (a * a), e = std::sqrt(e2);
  const double share = (1.0 - e2) / e2 * (std::atanh(e) / e - 1.0), across = 0.5 * (1.0 - share);
  const refine::TriangleMesh spheroid = ellipsoid(a, b);
  for (const double turned_deg : {0.0, 30.0, 60.0, 90.0}) {
    const double sine = std::sin(turned_deg * degree), sine2 = sine * sine;
    const double moved = 1.0 + sine2 / (1.0 - share) + (1.0 - sine2) / (1.0 - across);
    CAPTURE(turned_deg);
    CHECK(smooth_db(spheroid, turned_deg * degree) ==
          Approx(scatter::to_db(std::pow(k_per_m * k_per_m * volume_m3 / (4.0 * pi) * moved, 2.0)))
              .margin(0.3));
  }
  // A disc, which moves 8 a^3 / 3 of the fluid (Lamb, art. 102), though it has next to no volume.
  refine::TriangleMesh disc;
  constexpr double radius_m = 0.002;
  constexpr int sides = 32;
  for (int i = 0; i < sides; ++i) {
    const auto at = [&](int side) {
      const double angle_rad = 2.0 * pi * side / sides;
      return Eigen::Vector2d(radius_m * std::cos(angle_rad), radius_m * std::sin(angle_rad));
    };
    add_upright(disc, {Eigen::Vector2d::Zero(), at(i), at(i + 1)});
  }
  CHECK(smooth_db(disc) ==
        Approx(scatter::to_db(std::pow(2.0 / (3.0 * pi) * k_per_m * k_per_m, 2.0) *
                              std::pow(radius_m, 6.0)))
            .margin(0.3));
}

TEST_CASE(
    "the rough surface of a sphere that is smaller than the waves returns as little as its modes") {
  ShapeSize size;
  size.diameter_m = 0.005;
  const refine::TriangleMesh ball = body("sphere", size);
  const scatter::Solid rough{.diffuse_db = -10.0, .specular = 0.3};
  const auto level_db = [&](double at_hz) {
    const Sonar sonar = wide_sonar(cylinder_m + 2.0, at_hz);
    return target_strength_db(echo_of({ball, rough}, sonar, cylinder_m), sonar);
  };
  const double ka = k_per_m * 0.0025;
  CHECK(level_db(20e3) - level_db(1.2e6) ==
        Approx(sphere_db(ka) - scatter::to_db(0.25)).margin(0.5));
}
