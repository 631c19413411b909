#include <ensonify/engine/sonar/echo/glint.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include "support/catch.h"

#include <ensonify/engine/seafloor/objects/flat_parts.h>
#include <ensonify/engine/seafloor/objects/solids.h>
#include <ensonify/refine/triangle_mesh.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

/// A flat polygon in the plane z = 0, with corners on an ellipse, or at its four ends if there are
/// four, as a fan of triangles.
refine::TriangleMesh polygon(double a_m, double b_m, int corners, bool rectangle) {
  refine::TriangleMesh mesh;
  for (int i = 0; i < corners; ++i) {
    const double angle_rad = 2.0 * std::numbers::pi * (i + 0.5) / corners;
    const double reach = rectangle ? std::numbers::sqrt2 : 1.0;
    mesh.positions.emplace_back(static_cast<float>(reach * a_m * std::cos(angle_rad)),
                                static_cast<float>(reach * b_m * std::sin(angle_rad)), 0.0f);
  }
  for (std::uint32_t i = 1; i + 1 < static_cast<std::uint32_t>(corners); ++i)
    mesh.faces.push_back({0, i, i + 1});
  return mesh;
}

/// The cross-section of a body's flat parts that face the direction `way`, from far away.
double glints_m2(const std::vector<FlatPart>& flat_parts, const Eigen::Vector3d& way) {
  constexpr double range_m = 1e4, wavelength_m = 1500.0 / 400e3;
  double sum_m2 = 0.0;
  for (const FlatPart& flat_part : flat_parts) {
    const Eigen::Vector3d away = flat_part.middle - range_m * way;
    if (!(away.dot(flat_part.normal.cast<double>()) < 0.0)) continue;
    if (const std::optional<Mirror> mirror = mirror_of(flat_part, away, wavelength_m))
      sum_m2 += mirror->cross_section_m2(wavelength_m);
  }
  return sum_m2;
}

}  // namespace

TEST_CASE("the facets of a sphere or an ellipsoid glint as R1 R2 / 4 from every side") {
  Solids icosahedron;
  icosahedron.ball(Eigen::Vector3d::Zero(), 1.0, 0);
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  for (const int level : {2, 3, 4})
    for (const Eigen::Vector3d& half_axes_m :
         {Eigen::Vector3d(0.5, 0.5, 0.5), Eigen::Vector3d(5.0, 5.0, 5.0),
          Eigen::Vector3d(0.4, 0.5, 0.8), Eigen::Vector3d(0.5, 0.5, 1.5)}) {
      // So few facets are too coarse for what changes its radii over two of them.
      if (level == 2 && half_axes_m.x() != half_axes_m.z()) continue;
      Solids ball;
      ball.ball(Eigen::Vector3d::Zero(), 1.0, level);
      for (Eigen::Vector3f& place : ball.mesh.positions)
        place = place.cwiseProduct(half_axes_m.cast<float>()).eval();
      const std::vector<FlatPart> flat_parts = flat_parts_of(ball.mesh).whole;
      std::vector<Eigen::Vector3d> ways;
      for (int i = 0; i < 300; ++i)
        ways.push_back(
            Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized());
      // Where five facets meet, not six, the normal is that of the ellipsoid.
      for (const Eigen::Vector3f& vertex : icosahedron.mesh.positions)
        ways.push_back(vertex.cast<double>().cwiseQuotient(half_axes_m).normalized());
      double greatest_db = 0.0;
      for (const Eigen::Vector3d& way : ways) {
        const double r1_r2_m2 =
            std::pow(half_axes_m.prod() / half_axes_m.cwiseProduct(way).squaredNorm(), 2.0);
        greatest_db = std::max(
            greatest_db, std::abs(scatter::to_db(glints_m2(flat_parts, way) / (0.25 * r1_r2_m2))));
      }
      CAPTURE(level, half_axes_m.transpose());
      CHECK(greatest_db < 0.5);
    }
}

TEST_CASE("the facets that share the glint of a sphere or a cylinder have it at one place") {
  constexpr double range_m = 10.0, wavelength_m = 1500.0 / 900e3;
  Solids ball, cylinder;
  ball.ball(Eigen::Vector3d::Zero(), 1.0, 3);
  cylinder.revolve(std::array{Eigen::Vector2d(1.0, -0.2), Eigen::Vector2d(1.0, 0.2)}, 48);
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  for (const bool is_ball : {true, false}) {
    const std::vector<FlatPart> flat_parts =
        flat_parts_of(is_ball ? ball.mesh : cylinder.mesh).whole;
    for (int i = 0; i < 100; ++i) {
      const Eigen::Vector3d way =
          Eigen::Vector3d(normal(random), normal(random), is_ball ? normal(random) : 0.0)
              .normalized();
      double sum_m2 = 0.0, off_m4 = 0.0;
      for (const FlatPart& flat_part : flat_parts) {
        const Eigen::Vector3d away = flat_part.middle - range_m * way;
        if (!(away.dot(flat_part.normal.cast<double>()) < 0.0)) continue;
        const std::optional<Mirror> mirror = mirror_of(flat_part, away, wavelength_m);
        if (!mirror) continue;
        const double cross_section_m2 = mirror->cross_section_m2(wavelength_m);
        sum_m2 += cross_section_m2;
        off_m4 += cross_section_m2 * (flat_part.middle + mirror->offset - way).squaredNorm();
      }
      CAPTURE(is_ball, way.transpose());
      CHECK(std::sqrt(off_m4 / sum_m2) < 0.012);  // facets are of 13 cm
    }
  }
}

TEST_CASE("a flat elliptic flat part glints as the integral over its ellipse, near and far") {
  constexpr double wavelength_m = 1500.0 / 400e3, k = 2.0 * std::numbers::pi / wavelength_m;
  for (const double b_m : {0.3, 0.2, 0.1}) {
    constexpr double a_m = 0.3;
    const auto flat_parts = flat_parts_of(polygon(a_m, b_m, 96, false)).whole;
    REQUIRE(flat_parts.size() == 1);
    CHECK(flat_parts[0].round);
    CHECK(flat_parts[0].length_m / flat_parts[0].width_m == Approx(a_m / b_m).epsilon(1e-3));
    for (const double range_m : {20.0, 200.0})
      for (const auto& [t, s] : {std::pair(0.0, 0.0), std::pair(0.004, 0.0), std::pair(0.0, 0.006),
                                 std::pair(0.004, 0.005)}) {
        constexpr int steps = 600;
        std::complex<double> sum = 0.0;
        for (int i = 0; i < steps; ++i)
          for (int j = 0; j < steps; ++j) {
            const double u = (2.0 * (i + 0.5) / steps - 1.0), v = (2.0 * (j + 0.5) / steps - 1.0);
            if (u * u + v * v > 1.0) continue;
            const double off_m = a_m * u - range_m * t, aside_m = b_m * v - range_m * s;
            sum += std::polar(4.0 * a_m * b_m / steps / steps,
                              k / range_m * (off_m * off_m + aside_m * aside_m));
          }
        const Eigen::Vector3d away =
            range_m * Eigen::Vector3d(-t, -s, std::sqrt(1.0 - t * t - s * s));
        const std::optional<Mirror> mirror = mirror_of(flat_parts[0], away, wavelength_m);
        CAPTURE(b_m, range_m, t, s);
        REQUIRE(mirror);
        CHECK(scatter::to_db(mirror->cross_section_m2(wavelength_m)) ==
              Approx(scatter::to_db(std::norm(sum) / wavelength_m / wavelength_m)).margin(0.3));
      }
    CHECK_FALSE(flat_parts_of(polygon(a_m, b_m, 4, true)).whole[0].round);
  }
}
