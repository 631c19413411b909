#include <ensonify/engine/sonar/echo/glint.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <initializer_list>
#include <numbers>
#include <optional>
#include <random>
#include <span>
#include <tuple>
#include <vector>

#include "support/catch.h"

#include <ensonify/engine/seafloor/objects/flat_parts.h>
#include <ensonify/engine/seafloor/objects/object_surface.h>
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

/// The cross-section of a body's flat parts that face a sonar.
double glints_m2(const FlatParts& flat_parts, const Eigen::Vector3d& sonar, double wavelength_m) {
  double sum_m2 = 0.0;
  for (const FlatPart& flat_part : flat_parts.whole) {
    const Eigen::Vector3d away = flat_part.middle - sonar;
    if (!(away.dot(flat_part.normal.cast<double>()) < 0.0)) continue;
    if (const auto mirror = mirror_of(flat_part, flat_parts.curved, away, wavelength_m))
      sum_m2 += mirror->cross_section_m2;
  }
  return sum_m2;
}

/// A body of revolution about z, of places (radius, z), open at radii of more than 0.
refine::TriangleMesh turned(std::span<const Eigen::Vector2d> profile, int sides) {
  refine::TriangleMesh mesh;
  const auto at = [&](const Eigen::Vector2d& place, int side) {
    const double turn_rad = 2.0 * std::numbers::pi * (side % sides) / sides;
    return Eigen::Vector3d(place.x() * std::cos(turn_rad), place.x() * std::sin(turn_rad),
                           place.y())
        .cast<float>()
        .eval();
  };
  const auto add = [&](std::initializer_list<Eigen::Vector3f> corners) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), corners);
    mesh.faces.push_back({first, first + 1, first + 2});
  };
  for (std::size_t i = 0; i + 1 < profile.size(); ++i)
    for (int k = 0; k < sides; ++k) {
      const Eigen::Vector2d &low = profile[i], &high = profile[i + 1];
      if (low.x() > 0.0) add({at(low, k), at(low, k + 1), at(high, k + 1)});
      if (high.x() > 0.0) add({at(low, k), at(high, k + 1), at(high, k)});
    }
  return mesh;
}

/// A quarter of a circle about (0, z), from the axis or back to it.
std::vector<Eigen::Vector2d> round_end(double radius_m, double z_m, bool upper, int steps) {
  std::vector<Eigen::Vector2d> profile;
  for (int i = 0; i <= steps; ++i) {
    const double angle_rad = 0.5 * std::numbers::pi * (upper ? i : i - steps) / steps;
    profile.emplace_back(i == (upper ? steps : 0) ? 0.0 : radius_m * std::cos(angle_rad),
                         z_m + radius_m * std::sin(angle_rad));
  }
  return profile;
}

/// The echo of a cone's side, from a radius at z = 0 to one at z = height, of a sonar in the plane
/// y = 0: Kirchhoff's integral over the side, as a sum.
double cone_m2(double low_m, double high_m, double height_m, const Eigen::Vector3d& sonar,
               double wavelength_m) {
  constexpr int slope_steps = 600, turn_steps = 900;
  constexpr double half_rad = 0.35;  // about the sonar's direction; it fades towards the ends
  const double slope_m = std::hypot(height_m, low_m - high_m), range_m = sonar.norm();
  std::complex<double> sum = 0.0;
  for (int i = 0; i < slope_steps; ++i) {
    const double share = (i + 0.5) / slope_steps, radius_m = low_m + share * (high_m - low_m);
    for (int j = 0; j < turn_steps; ++j) {
      const double turn_rad = half_rad * (2.0 * (j + 0.5) / turn_steps - 1.0);
      const Eigen::Vector3d out(std::cos(turn_rad), std::sin(turn_rad), 0.0);
      const Eigen::Vector3d back =
          sonar - radius_m * out - share * height_m * Eigen::Vector3d::UnitZ();
      const Eigen::Vector3d normal =
          (height_m * out + (low_m - high_m) * Eigen::Vector3d::UnitZ()) / slope_m;
      const double r = back.norm();
      sum += std::polar(radius_m * (1.0 + std::cos(std::numbers::pi * turn_rad / half_rad)) *
                            normal.dot(back) / (r * r * r),
                        4.0 * std::numbers::pi / wavelength_m * (r - range_m));
    }
  }
  return std::norm(slope_m / slope_steps * half_rad / turn_steps * sum / wavelength_m) *
         std::pow((sonar - 0.5 * Eigen::Vector3d(low_m + high_m, 0.0, height_m)).norm(), 4.0);
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
      Solids ball;
      ball.ball(Eigen::Vector3d::Zero(), 1.0, level);
      for (Eigen::Vector3f& place : ball.mesh.positions)
        place = place.cwiseProduct(half_axes_m.cast<float>()).eval();
      const FlatParts flat_parts = flat_parts_of(ball.mesh);
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
            greatest_db, std::abs(scatter::to_db(glints_m2(flat_parts, 1e4 * way, 1500.0 / 400e3) /
                                                 (0.25 * r1_r2_m2))));
      }
      CAPTURE(level, half_axes_m.transpose());
      // At its tips the coarsest mesh turns by 48 degrees from facet to facet.
      CHECK(greatest_db < (level == 2 && half_axes_m.z() == 1.5 ? 1.5 : 0.5));
    }
}

TEST_CASE("a sphere glints as R^2 / 4 at its nearest place, however its facets lie") {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  const auto direction = [&] {
    return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
  };
  Solids even, uneven;
  even.ball(Eigen::Vector3d::Zero(), 1.0, 3);
  uneven.ball(Eigen::Vector3d::Zero(), 1.0, 3);
  for (Eigen::Vector3f& place : uneven.mesh.positions)
    place = (place + 0.05f * direction().cast<float>()).normalized();
  std::vector<Eigen::Vector2d> profile = round_end(1.0, 0.0, false, 8);
  profile.pop_back();
  for (const Eigen::Vector2d& place : round_end(1.0, 0.0, true, 5)) profile.push_back(place);
  const refine::TriangleMesh with_poles = turned(profile, 40);
  for (const refine::TriangleMesh& mesh : {even.mesh, uneven.mesh, with_poles}) {
    const FlatParts flat_parts = flat_parts_of(mesh);
    for (const double range_m : {10.0, 1000.0})
      for (int i = 0; i < 300; ++i) {
        Eigen::Vector3d way = direction();
        if (i < 100) way = (Eigen::Vector3d::UnitZ() + 0.002 * i * way).normalized();
        double sum_m2 = 0.0, off_m = 0.0;
        for (const FlatPart& flat_part : flat_parts.whole) {
          const Eigen::Vector3d away = flat_part.middle - (1.0 + range_m) * way;
          if (!(away.dot(flat_part.normal.cast<double>()) < 0.0)) continue;
          const auto mirror = mirror_of(flat_part, flat_parts.curved, away, 1500.0 / 900e3);
          if (!mirror) continue;
          sum_m2 += mirror->cross_section_m2;
          off_m = std::max(off_m, (flat_part.middle + mirror->offset - way).norm());
        }
        CAPTURE(mesh.faces.size(), range_m, way.transpose());
        CHECK(scatter::to_db(sum_m2) ==
              Approx(scatter::to_db(std::pow(0.5 * range_m / (1.0 + range_m), 2.0))).margin(0.1));
        CHECK(off_m < 0.002);  // facets are of 13 cm, or longer
      }
  }
}

TEST_CASE("a dome glints as a sphere up to its rim") {
  const FlatParts flat_parts = flat_parts_of(turned(round_end(1.0, 0.0, true, 8), 40));
  for (int i = 0; i < 200; ++i) {
    const double rise = (i + 1) / 201.0;
    const Eigen::Vector3d way(std::sqrt(1.0 - rise * rise) * std::cos(i),
                              std::sqrt(1.0 - rise * rise) * std::sin(i), rise);
    CAPTURE(way.transpose());
    CHECK(scatter::to_db(glints_m2(flat_parts, 1e4 * way, 1500.0 / 400e3)) ==
          Approx(scatter::to_db(0.25)).margin(0.1));
  }
}

TEST_CASE("a cone glints as Kirchhoff's integral over its side") {
  constexpr int sides = 24;
  for (const auto& [low_m, high_m, height_m] :
       {std::tuple{0.5, 0.0, 1.0}, {0.5, 0.25, 0.5}, {0.3, 0.1, 1.0}}) {
    const FlatParts flat_parts = flat_parts_of(
        turned(std::array{Eigen::Vector2d(low_m, 0.0), Eigen::Vector2d(high_m, height_m)}, sides));
    const double square_rad = std::atan2(low_m - high_m, height_m);
    for (const double wavelength_m : {1500.0 / 100e3, 1500.0 / 450e3})
      for (const double range_m : {10.0, 40.0})
        for (const double off_rad : {0.0, 0.002}) {
          const Eigen::Vector3d sonar =
              0.5 * Eigen::Vector3d(low_m + high_m, 0.0, height_m) +
              range_m * Eigen::Vector3d(std::cos(square_rad + off_rad), 0.0,
                                        std::sin(square_rad + off_rad));
          const double expected_m2 = cone_m2(low_m, high_m, height_m, sonar, wavelength_m);
          for (const double turn : {0.0, 0.3, 0.5, 0.9}) {
            CAPTURE(low_m, high_m, height_m, wavelength_m, range_m, off_rad, turn);
            CHECK(scatter::to_db(glints_m2(flat_parts,
                                           Eigen::AngleAxisd(turn * 2.0 * std::numbers::pi / sides,
                                                             Eigen::Vector3d::UnitZ()) *
                                               sonar,
                                           wavelength_m)) ==
                  Approx(scatter::to_db(expected_m2)).margin(0.6));
          }
        }
  }
}

TEST_CASE("a cylinder with round ends glints as one without, and its ends as spheres") {
  constexpr double radius_m = 0.25, half_m = 1.0, wavelength_m = 1500.0 / 400e3;
  constexpr int sides = 32;
  const auto part = [&](bool round) {
    std::vector<Eigen::Vector2d> profile = {{radius_m, -half_m}, {radius_m, half_m}};
    if (round) {
      profile = round_end(radius_m, -half_m, false, sides / 4);
      for (const Eigen::Vector2d& place : round_end(radius_m, half_m, true, sides / 4))
        profile.push_back(place);
    }
    return flat_parts_of(turned(profile, sides));
  };
  const FlatParts with_ends = part(true), without = part(false);
  for (const double range_m : {10.0, 50.0, 200.0}) {
    for (const double off_rad : {0.0, 0.002, 0.005}) {
      const Eigen::Vector3d sonar =
          range_m *
          Eigen::Vector3d(0.8 * std::cos(off_rad), 0.6 * std::cos(off_rad), std::sin(off_rad));
      CAPTURE(range_m, off_rad);
      // The glint of one of the spheres may add to the result.
      CHECK(glints_m2(with_ends, sonar, wavelength_m) ==
            Approx(glints_m2(without, sonar, wavelength_m))
                .epsilon(0.01)
                .margin(1.02 * 0.25 * radius_m * radius_m));
    }
    const Eigen::Vector3d slant =
        Eigen::Vector3d(0.0, 0.0, half_m) + range_m * Eigen::Vector3d(0.48, 0.64, 0.6);
    CHECK(scatter::to_db(glints_m2(with_ends, slant, wavelength_m)) ==
          Approx(scatter::to_db(std::pow(0.5 * radius_m * (range_m - radius_m) / range_m, 2.0)))
              .margin(0.1));
  }
}

TEST_CASE("the flat side of a body with rounded edges glints as a plate") {
  constexpr double half_m = 0.5, radius_m = 0.05, wavelength_m = 1500.0 / 100e3;
  std::vector<Eigen::Vector2d> outline;
  for (int i = 0; i < 28; ++i) {  // four quarters of a circle, of six steps each
    const int quarter = i / 7;
    const double quarter_rad = 0.5 * std::numbers::pi * quarter,
                 turn_rad = quarter_rad + 0.5 * std::numbers::pi * (i % 7) / 6.0;
    const Eigen::Vector2d middle = (half_m - radius_m) * std::numbers::sqrt2 *
                                   Eigen::Vector2d(std::cos(quarter_rad + 0.25 * std::numbers::pi),
                                                   std::sin(quarter_rad + 0.25 * std::numbers::pi));
    outline.emplace_back(middle +
                         radius_m * Eigen::Vector2d(std::cos(turn_rad), std::sin(turn_rad)));
  }
  refine::TriangleMesh mesh;
  for (const float z : {-0.5f, 0.5f})
    for (const Eigen::Vector2d& place : outline)
      mesh.positions.emplace_back(static_cast<float>(place.x()), static_cast<float>(place.y()), z);
  for (std::uint32_t i = 0; i < 28; ++i) {
    const std::uint32_t next = (i + 1) % 28;
    mesh.faces.push_back({i, next, 28 + next});
    mesh.faces.push_back({i, 28 + next, 28 + i});
  }
  const FlatParts flat_parts = flat_parts_of(mesh);
  const double plate_m2 = std::pow(2.0 * (half_m - radius_m) / wavelength_m, 2.0);
  CHECK(scatter::to_db(glints_m2(flat_parts, {2000.0, 0.0, 0.0}, wavelength_m)) ==
        Approx(scatter::to_db(plate_m2)).margin(0.1));
  // The edge is a quarter of a cylinder.
  CHECK(scatter::to_db(glints_m2(flat_parts, {1500.0, 1500.0, 0.0}, wavelength_m)) ==
        Approx(scatter::to_db(0.5 * radius_m / wavelength_m)).margin(0.3));
}

TEST_CASE("a block of flat parts contains the glints of their surface, which faces the sonar") {
  Solids ball, uneven;
  ball.ball(Eigen::Vector3d::Zero(), 1.0, 2);
  uneven.ball(Eigen::Vector3d::Zero(), 1.0, 3);
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  for (Eigen::Vector3f& place : uneven.mesh.positions) place.z() *= 0.2f;
  const std::array profile{Eigen::Vector2d(0.5, 0.0), Eigen::Vector2d(0.1, 1.0)};
  const refine::TriangleMesh cone = turned(profile, 12);
  constexpr double wavelength_m = 1500.0 / 400e3;
  for (const refine::TriangleMesh& mesh : {ball.mesh, uneven.mesh, cone}) {
    const ObjectSurface object(mesh, 1);
    std::size_t glints = 0;
    for (int i = 0; i < 500; ++i) {
      const Eigen::Vector3d sonar =
          (i % 2 ? 3.0 : 100.0) *
          Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
      for (const FlatPartBlock& block : object.blocks)
        for (std::size_t k = block.first; k < block.first + block.count; ++k) {
          const FlatPart& part = object.flat_parts[k];
          const Eigen::Vector3d away = part.middle - sonar;
          if (!(away.dot(part.normal.cast<double>()) < 0.0)) continue;
          const auto mirror = mirror_of(part, object.curved, away, wavelength_m);
          if (!mirror) continue;
          ++glints;
          CAPTURE(mesh.faces.size(), sonar.transpose());
          CHECK((part.middle + mirror->offset - block.middle).norm() < block.radius_m);
          CHECK(block.may_face(sonar, glint_reach(block, wavelength_m, away.norm()), false));
        }
    }
    CHECK(glints > 20);
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
        const std::optional<Mirror> mirror = mirror_of(flat_parts[0], {}, away, wavelength_m);
        CAPTURE(b_m, range_m, t, s);
        REQUIRE(mirror);
        CHECK(scatter::to_db(mirror->cross_section_m2) ==
              Approx(scatter::to_db(std::norm(sum) / wavelength_m / wavelength_m)).margin(0.3));
      }
    CHECK_FALSE(flat_parts_of(polygon(a_m, b_m, 4, true)).whole[0].round);
  }
}
