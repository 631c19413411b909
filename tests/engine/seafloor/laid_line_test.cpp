#include <ensonify/engine/seafloor/objects/laid_line.h>

#include <cmath>
#include <stdexcept>

#include "support/catch.h"
#include "support/meshes.h"

using namespace ensonify;
using namespace ensonify::engine;
using Eigen::Vector2d, Eigen::Vector3d;

namespace {

constexpr double step_m = 0.1, radius_m = 40.0;

std::vector<double> steps(std::size_t count) {
  std::vector<double> along_m;
  for (std::size_t i = 0; i < count; ++i) along_m.push_back(step_m * static_cast<double>(i));
  return along_m;
}

}  // namespace

TEST_CASE("A span over a gap sags by its length squared over eight radii") {
  const std::vector<double> along_m = steps(301);
  std::vector<double> ground_m(along_m.size(), -10.0);
  for (std::size_t i = 101; i < 200; ++i) ground_m[i] = -20.0;  // a gap of 10 m
  const std::vector<double> z_m = hang(along_m, ground_m, radius_m);
  CHECK(z_m[150] == Approx(-10.0 - 10.0 * 10.0 / (8.0 * radius_m)));
  CHECK(z_m[125] == Approx(-10.0 - 0.75 * 10.0 * 10.0 / (8.0 * radius_m)));
  CHECK(z_m[50] == -10.0);
}

TEST_CASE("A hanging line is the curve to which a relaxation step by step converges") {
  tests::Random random(5);
  const std::vector<double> along_m = steps(60);
  std::vector<double> ground_m;
  for (std::size_t i = 0; i < along_m.size(); ++i) ground_m.push_back(tests::uniform(random));
  // Starting far above, each point sinks until its neighbours or the ground hold it.
  std::vector<double> settled_m(along_m.size(), 100.0);
  settled_m.front() = ground_m.front();
  settled_m.back() = ground_m.back();
  for (int round = 0; round < 20000; ++round)
    for (std::size_t i = 1; i + 1 < along_m.size(); ++i)
      settled_m[i] = std::max(ground_m[i], 0.5 * (settled_m[i - 1] + settled_m[i + 1]) -
                                               0.5 * step_m * step_m / radius_m);
  const std::vector<double> z_m = hang(along_m, ground_m, radius_m);
  for (std::size_t i = 0; i < along_m.size(); ++i) {
    CAPTURE(i);
    REQUIRE(z_m[i] == Approx(settled_m[i]).margin(1e-7));
    REQUIRE(z_m[i] >= ground_m[i]);
  }
}

TEST_CASE("A tube lies on the bed with its underside and keeps the corners and ends of its path") {
  const std::vector<Vector2d> path{{0, 0}, {10, 0}, {10, 5}};
  const auto level = [](const Vector2d&) { return -7.0; };
  const std::vector<Vector3d> line = laid_line(path, 0.6, 0.25, 100.0, -0.1, level);
  CHECK(line.front() == Vector3d(0, 0, line.front().z()));
  CHECK(line.back().head<2>() == Vector2d(10, 5));
  bool corner = false;
  for (const Vector3d& p : line) {
    CHECK(p.z() == Approx(-7.0 + 0.3 - 0.1));
    corner = corner || p.head<2>() == Vector2d(10, 0);
  }
  CHECK(corner);
  // On a slope of 45 degrees across the tube, the circle does not touch at its lowest point.
  const std::vector<Vector3d> slope =
      laid_line(std::vector<Vector2d>{{0, 0}, {10, 0}}, 2.0, 1.0, 100.0, 0.0,
                [](const Vector2d& p) { return p.y(); });
  CHECK(slope.front().z() == Approx(std::sqrt(2.0)).epsilon(0.05));
  CHECK_THROWS_AS(laid_line(std::vector<Vector2d>{{1, 1}, {1, 1}}, 0.6, 0.25, 100.0, 0.0, level),
                  std::invalid_argument);
}
