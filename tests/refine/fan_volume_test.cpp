#include <ensonify/refine/fan_volume.h>

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include <Eigen/Geometry>

#include "support/catch.h"
#include "support/meshes.h"

#include <ensonify/scatter/angle.h>

using namespace ensonify::refine;
using ensonify::scatter::degree;
using ensonify::tests::Random;
using ensonify::tests::uniform;

namespace {

FanVolume random_fan(Random& random, double from_origin_m = 100.0) {
  const Eigen::Matrix3d axes = ensonify::tests::frame(random);
  const double low = uniform(random, -89.0, 85.0);
  return {.apex = from_origin_m * ensonify::tests::direction(random),
          .array_axis = axes.col(0),
          .middle = axes.col(1),
          .pole = axes.col(2),
          .truncation_rad = degree * std::pow(10.0, uniform(random, -1.5, 1.9)),
          .elevation_low_rad = degree * low,
          .elevation_high_rad = degree * uniform(random, low, 89.0),
          .range_m = std::pow(10.0, uniform(random, 0.0, 3.0))};
}

/// A ray of the fan: elevation e, rotated by phi about the pole.
Eigen::Vector3d ray(const FanVolume& v, double e, double phi) {
  return std::cos(e) * (std::cos(phi) * v.middle + std::sin(phi) * v.array_axis) +
         std::sin(e) * v.pole;
}

/// The largest rotation at an elevation: sin(truncation) = cos e sin phi, or a full turn.
double widest_turn(const FanVolume& v, double e) {
  return std::asin(std::min(1.0, std::sin(v.truncation_rad) / std::cos(e)));
}

/// A point of the volume, often on its edges.
Eigen::Vector3d point_inside(const FanVolume& v, Random& random) {
  const auto edge_or_between = [&](double low, double high) {
    const double x = uniform(random, -0.5, 1.5);
    return x < 0.0 ? low : x > 1.0 ? high : low + x * (high - low);
  };
  const double e = edge_or_between(v.elevation_low_rad, v.elevation_high_rad);
  const double turn = widest_turn(v, e);
  return v.apex + edge_or_between(0.0, v.range_m) * ray(v, e, edge_or_between(-turn, turn));
}

bool touches(const FanVolume& volume, const Eigen::Vector3d& centre, double radius) {
  return ViewTest({&volume, 1}).touches({centre.cast<float>(), static_cast<float>(radius)});
}

using Triangle = std::array<Eigen::Vector3d, 3>;

bool touches(const FanVolume& volume, const Triangle& triangle) {
  return ViewTest({&volume, 1})
      .touches(ViewTest::Corners{triangle[0].cast<float>(), triangle[1].cast<float>(),
                                 triangle[2].cast<float>()});
}

Triangle random_triangle(const Eigen::Vector3d& near, double size_m, Random& random) {
  Triangle triangle;
  for (Eigen::Vector3d& corner : triangle)
    corner = near + size_m * uniform(random) * ensonify::tests::direction(random);
  return triangle;
}

FanVolume narrow_fan() {
  return {.array_axis = Eigen::Vector3d::UnitY(),
          .middle = Eigen::Vector3d(0.6, 0.0, -0.8),
          .pole = Eigen::Vector3d(0.8, 0.0, 0.6),
          .truncation_rad = 2.0 * degree,
          .elevation_low_rad = -40.0 * degree,
          .elevation_high_rad = 40.0 * degree,
          .range_m = 100.0};
}

}  // namespace

TEST_CASE("a sphere that reaches a point of a ray touches its fan volume") {
  Random random(1);
  int missed = 0;
  for (int i = 0; i < 2000; ++i) {
    const FanVolume v = random_fan(random, i % 2 ? 100.0 : 5000.0);
    for (int k = 0; k < 50; ++k) {
      const Eigen::Vector3d p = point_inside(v, random);
      const double radius = k % 3 ? std::pow(10.0, uniform(random, -3.0, 2.5)) : 0.0;
      missed += !touches(v, p + radius * ensonify::tests::direction(random), radius);
    }
  }
  CHECK(missed == 0);
}

TEST_CASE("float rays at the edges of the fan do not leave its fan volume") {
  Random random(2);
  int missed = 0;
  for (int i = 0; i < 2000; ++i) {
    FanVolume v = random_fan(random, i % 2 ? 0.0 : 50000.0);
    if (i % 2) v.range_m *= 100.0;
    const Eigen::Vector3f origin = v.apex.cast<float>();
    for (const double e : {v.elevation_low_rad, v.elevation_high_rad})
      for (const double side : {-1.0, 0.0, 1.0}) {
        const Eigen::Vector3f d = ray(v, e, side * widest_turn(v, e)).cast<float>();
        const auto range = static_cast<float>(v.range_m);
        for (const float t : {0.1f * range, range})
          missed += !touches(v, (origin + t * d).cast<double>(), 0.0);
      }
  }
  CHECK(missed == 0);
}

TEST_CASE("a larger sphere touches all that a smaller one touches") {
  Random random(3);
  int shrunk = 0;
  for (int i = 0; i < 20000; ++i) {
    const FanVolume v = random_fan(random);
    const Eigen::Vector3d centre =
        v.apex + 2.0 * v.range_m * uniform(random) * ensonify::tests::direction(random);
    bool before = false;
    for (double radius = 0.01; radius < 4.0 * v.range_m; radius *= 1.7) {
      const bool now = touches(v, centre, radius);
      shrunk += before && !now;
      before = now;
    }
    CHECK(before);
  }
  CHECK(shrunk == 0);
}

TEST_CASE("each surface of the fan volume rejects a sphere that ends a centimetre before it") {
  Random random(4);
  std::array<int, 4> touched{}, reached{};
  for (int i = 0; i < 20000; ++i) {
    const FanVolume v = {.apex = 10.0 * ensonify::tests::direction(random),
                         .array_axis = Eigen::Vector3d::UnitY(),
                         .middle = Eigen::Vector3d(0.6, 0.0, -0.8),
                         .pole = Eigen::Vector3d(0.8, 0.0, 0.6),
                         .truncation_rad = uniform(random, 0.2, 20.0) * degree,
                         .elevation_low_rad = uniform(random, -60.0, -5.0) * degree,
                         .elevation_high_rad = uniform(random, 5.0, 60.0) * degree,
                         .range_m = 200.0};
    const double t = uniform(random, 50.0, 150.0), side = i % 2 ? 1.0 : -1.0;
    const double e = uniform(random, v.elevation_low_rad, v.elevation_high_rad);
    const double turn = widest_turn(v, e);
    const double limit = side > 0.0 ? v.elevation_high_rad : v.elevation_low_rad;
    const double phi_at_limit = uniform(random, -0.9, 0.9) * widest_turn(v, limit);
    struct Place {
      Eigen::Vector3d on, outwards;
    };
    const Eigen::Vector3d on_cone = ray(v, e, side * turn);
    const Eigen::Vector3d across =
        (on_cone - on_cone.dot(v.array_axis) * v.array_axis).normalized();
    const Eigen::Vector3d on_limit = ray(v, limit, phi_at_limit);
    const Eigen::Vector3d level = (on_limit - on_limit.dot(v.pole) * v.pole).normalized();
    const std::array<Place, 4> places{
        {{t * on_cone,
          std::cos(v.truncation_rad) * side * v.array_axis - std::sin(v.truncation_rad) * across},
         {t * on_limit, side * (std::cos(limit) * v.pole - std::sin(limit) * level)},
         {v.range_m * ray(v, e, 0.3 * turn), ray(v, e, 0.3 * turn)},
         {Eigen::Vector3d::Zero(), -v.middle}}};
    for (std::size_t k = 0; k < places.size(); ++k) {
      const double radius = std::pow(10.0, uniform(random, -1.0, 0.5));
      const Eigen::Vector3d on = v.apex + places[k].on, out = places[k].outwards;
      touched[k] += touches(v, on + (radius + 0.01) * out, radius);
      reached[k] += touches(v, on + (radius - 0.001) * out, radius);
    }
  }
  for (std::size_t k = 0; k < touched.size(); ++k) {
    CHECK(touched[k] == 0);
    CHECK(reached[k] == 20000);
  }
}

TEST_CASE("few spheres near a narrow fan are kept without reaching it") {
  Random random(5);
  const FanVolume v = narrow_fan();
  std::vector<Eigen::Vector3d> rays;
  for (int i = 0; i <= 160; ++i)
    for (int j = 0; j <= 8; ++j) {
      const double e = (-40.0 + 0.5 * i) * degree;
      rays.push_back(ray(v, e, (0.25 * j - 1.0) * widest_turn(v, e)));
    }
  int reach = 0, kept = 0;
  for (int i = 0; i < 4000; ++i) {
    const Eigen::Vector3d centre = (i % 4 ? point_inside(v, random) : Eigen::Vector3d::Zero()) +
                                   uniform(random, 0.0, 20.0) * ensonify::tests::direction(random);
    const double radius = uniform(random, 0.5, 10.0);
    double nearest = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& d : rays)
      nearest = std::min(nearest, (centre - std::clamp(centre.dot(d), 0.0, 100.0) * d).norm());
    reach += nearest <= radius;
    kept += touches(v, centre, radius);
  }
  CHECK(kept >= reach);
  CHECK(kept <= 1.1 * reach);
}

TEST_CASE("a triangle through a point of a ray touches its fan volume") {
  Random random(7);
  int missed = 0;
  for (int i = 0; i < 20000; ++i) {
    const FanVolume v = random_fan(random);
    const Eigen::Vector3d inside = point_inside(v, random);
    Triangle triangle =
        random_triangle(inside, v.range_m * std::pow(10.0, uniform(random, -3.0, 1.0)), random);
    const double u = uniform(random), w = uniform(random) * (1.0 - u);
    const Eigen::Vector3d at =
        triangle[0] + u * (triangle[1] - triangle[0]) + w * (triangle[2] - triangle[0]);
    for (Eigen::Vector3d& corner : triangle) corner += inside - at;
    missed += !touches(v, triangle);
  }
  CHECK(missed == 0);
}

TEST_CASE("all spheres around a triangle that touches a fan volume touch it, also if it is wider") {
  Random random(8);
  int touching = 0, near_edge = 0, missed = 0, missed_by_wider = 0;
  for (int i = 0; i < 5000; ++i) {
    FanVolume v = random_fan(random);
    v.elevation_low_rad = -std::abs(v.elevation_low_rad);
    v.elevation_high_rad = std::abs(v.elevation_high_rad);
    const double size_m = v.range_m * std::pow(10.0, uniform(random, -3.0, -0.5));
    const Triangle inside = random_triangle(point_inside(v, random), size_m, random);
    // The farthest way along a line on which it still touches.
    const Eigen::Vector3d onwards = ensonify::tests::direction(random);
    const auto at = [&](double way_m) {
      Triangle there = inside;
      for (Eigen::Vector3d& corner : there) corner += way_m * onwards;
      return there;
    };
    double near_m = 0.0, far_m = 3.0 * v.range_m;
    for (int step = 0; step < 40; ++step) {
      const double way_m = 0.5 * (near_m + far_m);
      (touches(v, at(way_m)) ? near_m : far_m) = way_m;
    }
    const Triangle triangle = at(near_m);
    if (!touches(v, triangle)) continue;
    ++touching;
    // The sphere around the farthest corners, or a larger one about another point.
    Eigen::Vector3d middle = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
    if (i % 2) middle += size_m * uniform(random) * ensonify::tests::direction(random);
    middle = middle.cast<float>().cast<double>();
    double radius = 0.0;
    for (const Eigen::Vector3d& corner : triangle)
      radius = std::max(radius, (corner.cast<float>().cast<double>() - middle).norm());
    missed += !touches(v, middle, radius * (1.0 + 1e-6));
    near_edge += !touches(v, middle, 0.9 * radius);
    // As a face source widens a volume for the next pings.
    FanVolume wide = v;
    const Eigen::Vector3d way = 0.01 * v.range_m * ensonify::tests::direction(random);
    const Eigen::AngleAxisd turn(uniform(random, 0.0, 0.02), ensonify::tests::direction(random));
    wide.apex += way;
    wide.margin_m = way.norm();
    for (Eigen::Vector3d FanVolume::*axis :
         {&FanVolume::array_axis, &FanVolume::middle, &FanVolume::pole}) {
      wide.*axis = turn * (wide.*axis);
      wide.margin_m += (wide.*axis - v.*axis).norm() * v.range_m;
    }
    missed_by_wider += !touches(wide, middle, radius * (1.0 + 1e-6));
  }
  CHECK(touching > 4000);
  CHECK(near_edge > 100);
  CHECK(missed == 0);
  CHECK(missed_by_wider == 0);
}

TEST_CASE("a triangle a centimetre outside of a surface of the fan volume does not touch it") {
  Random random(9);
  const FanVolume v = narrow_fan();
  const double sine = std::sin(v.truncation_rad), cosine = std::cos(v.truncation_rad);
  std::array<int, 4> count{}, touching{};
  for (int i = 0; i < 20'000; ++i) {
    const Triangle triangle =
        random_triangle(point_inside(v, random), uniform(random, 0.1, 40.0), random);
    // The least distances of 231 points of it from each surface, positive outside.
    std::array<double, 4> least;
    least.fill(std::numeric_limits<double>::infinity());
    std::array<double, 2> side = {least[0], least[0]};
    constexpr int steps = 20;
    for (int j = 0; j <= steps; ++j)
      for (int k = 0; j + k <= steps; ++k) {
        const Eigen::Vector3d p = triangle[0] + j * (triangle[1] - triangle[0]) / steps +
                                  k * (triangle[2] - triangle[0]) / steps;
        const double a = p.dot(v.array_axis), m = p.dot(v.middle), h = p.dot(v.pole);
        const double q = std::hypot(m, h), w = std::hypot(a, m);
        side[0] = std::min(side[0], cosine * a - sine * q);
        side[1] = std::min(side[1], -cosine * a - sine * q);
        least[1] = std::min(least[1], p.norm() - v.range_m);
        least[2] = std::min(least[2], h * std::cos(40.0 * degree) - w * std::sin(40.0 * degree));
        least[3] = std::min(least[3], -h * std::cos(40.0 * degree) - w * std::sin(40.0 * degree));
      }
    least[0] = std::max(side[0], side[1]);
    const bool touch = touches(v, triangle);
    for (std::size_t k = 0; k < least.size(); ++k) {
      // The points are apart, but outside of a ball an edge comes nearer by little between them.
      if (!(least[k] > (k == 1 ? 0.1 : 0.01))) continue;
      ++count[k];
      touching[k] += touch;
    }
  }
  for (std::size_t k = 0; k < count.size(); ++k) {
    CAPTURE(k);
    CHECK(count[k] > 20);
    CHECK(touching[k] == 0);
  }
}

TEST_CASE("of several fan volumes any may be touched, and without volumes nothing touches") {
  Random random(6);
  ViewTest test;
  CHECK_FALSE(test.touches({Eigen::Vector3f::Zero(), 1e6f}));
  for (int i = 0; i < 1000; ++i) {
    std::vector<FanVolume> volumes;
    for (int k = 0; k < i % 4; ++k) volumes.push_back(random_fan(random));
    test.look_at(volumes);
    for (int k = 0; k < 20; ++k) {
      const Eigen::Vector3d centre = 300.0 * uniform(random) * ensonify::tests::direction(random);
      const double radius = 30.0 * uniform(random);
      bool any = false;
      for (const FanVolume& v : volumes) any |= touches(v, centre, radius);
      CHECK(test.touches({centre.cast<float>(), static_cast<float>(radius)}) == any);
    }
  }
}

TEST_CASE("invalid fans are refused") {
  const FanVolume good = {
      .truncation_rad = 0.1, .elevation_low_rad = -1.0, .elevation_high_rad = 1.0, .range_m = 10.0};
  const auto refuses = [&](auto change) {
    FanVolume v = good;
    change(v);
    CHECK_THROWS_AS(ViewTest({&v, 1}), std::invalid_argument);
  };
  CHECK_NOTHROW(ViewTest({&good, 1}));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refuses([](FanVolume& v) { v.middle = v.array_axis; });
  refuses([](FanVolume& v) { v.pole *= 1.001; });
  refuses([&](FanVolume& v) { v.apex.y() = nan; });
  refuses([&](FanVolume& v) { v.array_axis.x() = nan; });
  refuses([](FanVolume& v) { v.truncation_rad = -0.1; });
  refuses([](FanVolume& v) { v.truncation_rad = 1.6; });
  refuses([&](FanVolume& v) { v.truncation_rad = nan; });
  refuses([](FanVolume& v) { v.elevation_low_rad = -1.6; });
  refuses([](FanVolume& v) { v.elevation_high_rad = 1.6; });
  refuses([](FanVolume& v) { v.elevation_high_rad = -1.1; });
  refuses([](FanVolume& v) { v.range_m = -1.0; });
  refuses([&](FanVolume& v) { v.range_m = nan; });
  refuses([](FanVolume& v) { v.range_m = std::numeric_limits<double>::infinity(); });
}
