#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "support/catch.h"
#include "support/data.h"

#include <ensonify/scatter/angle.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/eigenray.h>
#include <ensonify/scatter/sound_ray.h>

using namespace ensonify::scatter;

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();

const SoundSpeedProfile shallow_duct({{1.81, 1481.35},
                                      {3.35, 1476.16},
                                      {5.0, 1475.21},
                                      {6.1, 1475.21},
                                      {9.76, 1478.1},
                                      {100.0, 1482.31}});
// 30 m/s over 4 m.
const SoundSpeedProfile thermocline(
    {{0.0, 1520.0}, {10.0, 1520.0}, {14.0, 1490.0}, {60.0, 1490.5}});

SoundRay launched(const SoundSpeedProfile& profile, double depth_m, double rad) {
  return {profile, depth_m, std::cos(rad), std::sin(rad)};
}

/// Advances to the range or the path length, whichever comes first.
SoundRay& go(SoundRay& ray, double range_m, double path_m = inf) {
  for (;;) {
    const double end_m = std::min(ray.path_to_range_m(range_m), path_m - ray.point().path_m);
    const double edge_m = ray.path_to_edge_m();
    ray.advance(std::min(end_m, edge_m));
    if (end_m <= edge_m) return ray;
  }
}

/// The ray's differential equations by the Runge-Kutta method: an independent way to the same arc.
struct Stepped {
  double r = 0.0, z, angle, t = 0.0;
  void run(const SoundSpeedProfile& profile, double path_m, int steps) {
    const auto slope = [&](double depth, double a) {
      const auto& layer = profile.layers()[profile.layer_index(depth)];
      const double c = profile.speed_mps(depth);
      return std::array{std::cos(a), std::sin(a), -std::cos(a) * layer.gradient_per_s / c, 1.0 / c};
    };
    const double h = path_m / steps;
    for (int i = 0; i < steps; ++i) {
      const auto k1 = slope(z, angle);
      const auto k2 = slope(z + 0.5 * h * k1[1], angle + 0.5 * h * k1[2]);
      const auto k3 = slope(z + 0.5 * h * k2[1], angle + 0.5 * h * k2[2]);
      const auto k4 = slope(z + h * k3[1], angle + h * k3[2]);
      const auto mean = [&](int i_) {
        return h / 6.0 * (k1[i_] + 2 * k2[i_] + 2 * k3[i_] + k4[i_]);
      };
      r += mean(0), z += mean(1), angle += mean(2), t += mean(3);
    }
  }
};

}  // namespace

TEST_CASE("In water of one speed a ray is straight and spreads as the square of its path") {
  const SoundSpeedProfile still({{5.0, 1500.0}, {50.0, 1500.0}});
  for (const double launch : {-60.0, -5.0, 0.0, 1e-6, 12.0, 80.0, 90.0}) {
    SoundRay ray = launched(still, 30.0, launch * degree);
    go(ray, inf, 200.0);
    const SoundRayPoint& p = ray.point();
    CHECK(p.path_m == Approx(200.0).epsilon(1e-14));
    CHECK(p.range_m == Approx(200.0 * std::cos(launch * degree)).epsilon(1e-14).margin(1e-13));
    CHECK(p.depth_m == Approx(30.0 + 200.0 * std::sin(launch * degree)).epsilon(1e-14));
    CHECK(p.time_s == Approx(200.0 / 1500.0).epsilon(1e-14));
    CHECK(ray.spreading_m2() == Approx(200.0 * 200.0).epsilon(1e-12));
    CHECK(ray.loss_db() == Approx(20.0 * std::log10(200.0)).epsilon(1e-12));
  }
}

TEST_CASE("The time between two points of one gradient has the closed form") {
  // acosh(1 + g^2 d^2 / (2 c c')) / |g|: 42.666615 ms in this case, computed by hand.
  const SoundSpeedProfile profile({{0.0, 1500.6}, {100.0, 1480.6}});
  const auto found = find_eigenray(profile, {.source_depth_m = 3, .range_m = 60, .depth_m = 25});
  REQUIRE(found);
  SoundRay ray = *found;
  CHECK(go(ray, 60.0).point().time_s == Approx(42.666615e-3).margin(1e-9));

  std::mt19937 random(3);
  std::uniform_real_distribution<double> gradient(-8.0, 8.0), range(1.0, 80.0), depth(1.0, 29.0);
  for (int i = 0; i < 100; ++i) {
    const double g = gradient(random), r = range(random), z0 = depth(random), z1 = depth(random);
    const SoundSpeedProfile steep({{0.0, 1500.0 - 15.0 * g}, {30.0, 1500.0 + 15.0 * g}});
    const auto eigen = find_eigenray(
        steep,
        {.source_depth_m = z0, .range_m = r, .depth_m = z1, .surface_m = 0.0, .bottom_m = 30.0});
    if (!eigen) continue;
    SoundRay arc = *eigen;
    const double c0 = steep.speed_mps(z0), c1 = steep.speed_mps(z1);
    const double d2 = r * r + (z1 - z0) * (z1 - z0);
    const double expected = std::acosh(1.0 + g * g * d2 / (2.0 * c0 * c1)) / std::abs(g);
    CHECK(go(arc, r).point().time_s == Approx(expected).margin(1e-9));
    CHECK(arc.point().depth_m == Approx(z1).margin(1e-6));
  }
}

TEST_CASE("A ray follows the differential equations, through turns and edges") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> angle(-15.0, 40.0), depth(0.5, 30.0);
  for (const SoundSpeedProfile* profile : {&shallow_duct, &thermocline})
    for (int i = 0; i < 40; ++i) {
      const double z = depth(random), launch = angle(random) * degree;
      Stepped stepped{.z = z, .angle = launch};
      stepped.run(*profile, 150.0, 30000);
      SoundRay ray = launched(*profile, z, launch);
      const SoundRayPoint& p = go(ray, inf, 150.0).point();
      // Steps across an edge are the method's error: some tenths of a millimetre near turning
      // points.
      CHECK(p.range_m == Approx(stepped.r).margin(1e-4));
      CHECK(p.depth_m == Approx(stepped.z).margin(2e-3));
      CHECK(p.time_s == Approx(stepped.t).margin(1e-8));
      CHECK(p.along * p.along + p.down * p.down == Approx(1.0).epsilon(1e-13));
    }
}

TEST_CASE("A ray loses what the water along it absorbs") {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> angle(-15.0, 40.0), depth(0.5, 30.0);
  const SoundSpeedProfile one_gradient({{0.0, 1530.0}, {60.0, 1440.0}});
  for (const SoundSpeedProfile* speeds : {&shallow_duct, &thermocline, &one_gradient}) {
    const SoundSpeedProfile profile = speeds->with_absorption(
        [](double depth_m, double mps) { return 1e-3 * (mps - 1400.0) + 1e-4 * depth_m; });
    const auto at = [&](double z) { return profile.mean_absorption_db_per_m(z, z); };
    for (int i = 0; i < 20; ++i) {
      const double z = depth(random), launch = angle(random) * degree;
      Stepped stepped{.z = z, .angle = launch};
      double expected_db = 0.0;
      for (double before = at(z), s = 0.0; s < 150.0 - 1e-6; s += 0.02) {
        stepped.run(profile, 0.02, 2);
        expected_db += 0.01 * (before + at(stepped.z));
        before = at(stepped.z);
      }
      SoundRay ray = launched(profile, z, launch);
      CHECK(go(ray, inf, 150.0).point().absorption_db == Approx(expected_db).epsilon(2e-4));
    }
  }
}

TEST_CASE("Spreading is the distance between neighbouring rays") {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> angle(-12.0, 60.0), depth(0.5, 30.0);
  for (const SoundSpeedProfile* profile : {&shallow_duct, &thermocline})
    for (int i = 0; i < 60; ++i) {
      const double z = depth(random), launch = angle(random) * degree, step = 1e-6;
      const auto place = [&](double rad) {
        SoundRay ray(*profile, z, std::cos(rad), std::sin(rad), 0.0, 60.0);  // also reflected
        return go(ray, 150.0).point().depth_m;
      };
      SoundRay ray(*profile, z, std::cos(launch), std::sin(launch), 0.0, 60.0);
      go(ray, 150.0);
      const double below = place(launch - step), above = place(launch + step);
      const double here = ray.point().depth_m;
      if (std::abs(above - 2.0 * here + below) > 1e-3 * std::abs(above - below))
        continue;  // a kink
      const double spread = std::abs(above - below) / (2.0 * step) * ray.point().along;
      CHECK(std::abs(ray.spread_m()) == Approx(spread).epsilon(2e-3).margin(0.01));
      CHECK(ray.spreading_m2() >= Approx(spread * 150.0 / std::cos(launch)).epsilon(3e-3));
    }
}

TEST_CASE("At a caustic the gain stays within 20 dB") {
  // In a duct rays cross their neighbours again and again: their spreading changes its sign.
  double max_db = -inf;
  int caustics = 0;
  for (double launch = -3.0; launch < 3.0; launch += 0.01) {
    SoundRay ray = launched(shallow_duct, 5.5, launch * degree);
    double before_m = 0.0;
    for (int i = 0; i < 2000; ++i) {
      ray.advance(std::min(0.25, ray.path_to_edge_m()));
      max_db = std::max(max_db, 20.0 * std::log10(ray.point().path_m) - to_db(ray.spreading_m2()));
      caustics += ray.spread_m() * before_m < 0.0;
      before_m = ray.spread_m();
    }
  }
  CHECK(caustics > 100);
  CHECK(max_db <= 20.0 + 1e-9);
  CHECK(max_db > 19.9);
}

TEST_CASE("A ray and the ray back have the same time, path and loss") {
  const EigenrayEnds there{.source_depth_m = 6, .range_m = 120, .depth_m = 31};
  const EigenrayEnds back{.source_depth_m = 31, .range_m = 120, .depth_m = 6};
  for (const SoundSpeedProfile* profile : {&shallow_duct, &thermocline}) {
    auto out = find_eigenray(*profile, there), home = find_eigenray(*profile, back);
    REQUIRE((out && home));
    go(*out, 120.0), go(*home, 120.0);
    CHECK(out->point().depth_m == Approx(31.0).margin(1e-9));
    CHECK(home->point().depth_m == Approx(6.0).margin(1e-9));
    CHECK(out->point().time_s == Approx(home->point().time_s).epsilon(1e-12));
    CHECK(out->point().path_m == Approx(home->point().path_m).epsilon(1e-12));
    CHECK(out->loss_db() == Approx(home->loss_db()).epsilon(1e-9));
    CHECK(out->spreading_back_m2() == Approx(home->spreading_m2()).epsilon(1e-9));
    CHECK(out->spreading_m2() != Approx(home->spreading_m2()).epsilon(1e-3));
  }
}

TEST_CASE("A reflected ray is a ray through the mirror image") {
  // Down to 40 m and up again is down through the profile and its mirror image below 40 m.
  const SoundSpeedProfile once({{0.0, 1500.0}, {20.0, 1490.0}, {40.0, 1498.0}});
  const SoundSpeedProfile twice(
      {{0.0, 1500.0}, {20.0, 1490.0}, {40.0, 1498.0}, {60.0, 1490.0}, {80.0, 1500.0}});
  SoundRay bounced(once, 5.0, std::cos(0.4), std::sin(0.4), 0.0, 40.0);
  SoundRay through = launched(twice, 5.0, 0.4);
  go(bounced, inf, 120.0), go(through, inf, 120.0);
  CHECK(bounced.reflections() == 1);
  CHECK(bounced.point().depth_m == Approx(80.0 - through.point().depth_m));
  CHECK(bounced.point().range_m == Approx(through.point().range_m));
  CHECK(bounced.point().time_s == Approx(through.point().time_s));
  CHECK(bounced.point().down == Approx(-through.point().down));
  CHECK(bounced.spread_m() == Approx(through.spread_m()));
}

TEST_CASE(
    "Newton's steps from the straight line find the first ray to arrive, up, down and level") {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit;
  int found = 0;
  for (const SoundSpeedProfile* profile : {&shallow_duct, &thermocline})
    for (int i = 0; i < 300; ++i) {
      const EigenrayEnds ends{.source_depth_m = 1.0 + 25.0 * unit(random),
                              .range_m = 1.0 + 60.0 * unit(random),
                              .depth_m = 1.0 + 25.0 * unit(random)};
      CAPTURE(ends.source_depth_m, ends.range_m, ends.depth_m);
      const std::optional<ArrivedRay> near = find_near_eigenray(*profile, ends);
      if (!near) continue;
      ++found;
      SoundRay first = find_eigenray(*profile, ends).value();
      CHECK(near->along == Approx(first.point().along).margin(1e-6));
      CHECK(near->down == Approx(first.point().down).margin(1e-6));
      const SoundRayPoint& there = go(first, ends.range_m).point();
      CHECK(near->ray.point().depth_m == Approx(ends.depth_m).margin(1e-5));
      CHECK(near->ray.point().time_s == Approx(there.time_s).margin(1e-8));
      CHECK(near->ray.loss_db() == Approx(first.loss_db()).margin(1e-4));
    }
  CHECK(found > 590);
  const auto below = find_near_eigenray(thermocline, {.source_depth_m = 3, .depth_m = 25});
  REQUIRE(below);
  CHECK(below->down == 1.0);
}

TEST_CASE("A level ray bends to the slower side, and runs straight along a duct's axis") {
  SoundRay axis = launched(shallow_duct, 6.1, 0.0);
  CHECK(go(axis, 500.0).point().depth_m == 6.1);
  SoundRay upper_axis = launched(shallow_duct, 5.0, 0.0);
  CHECK(go(upper_axis, 500.0).point().depth_m == 5.0);
  SoundRay falls = launched(shallow_duct, 3.35, 0.0);  // slower below
  CHECK(go(falls, 20.0).point().depth_m > 3.35);
  SoundRay rises = launched(shallow_duct, 9.76, 0.0);
  CHECK(go(rises, 20.0).point().depth_m < 9.76);
}

TEST_CASE("A ray that is level except for rounding runs along a duct's axis in few steps") {
  const SoundSpeedProfile duct({{0.0, 1510.0}, {12.0, 1500.0}, {40.0, 1502.0}});
  for (const double down : {3e-14, -3e-14, 1e-18, 1e-10}) {
    SoundRay ray(duct, 12.0, 1.0, down);
    int steps = 0;
    for (; steps < 10 && std::isfinite(ray.path_to_edge_m()); ++steps)
      ray.advance(ray.path_to_edge_m());
    CHECK(steps < 10);
    CHECK(go(ray, 500.0).point().depth_m == Approx(12.0).margin(1e-6));
    CHECK(ray.point().time_s == Approx(500.0 / 1500.0).epsilon(1e-9));
  }
  // A ray that oscillates by more is followed: its arcs' chords are 2 c tan(angle) / g long.
  SoundRay ray = launched(duct, 12.0, 1e-4);
  ray.advance(ray.path_to_edge_m());
  CHECK(ray.point().range_m == Approx(2.0 * 1500.0 * std::tan(1e-4) / (2.0 / 28.0)));
  ray.advance(ray.path_to_edge_m());
  CHECK(ray.point().down == Approx(std::sin(1e-4)));
}

TEST_CASE("No ray reaches a shadow zone, and invalid directions and ends are refused") {
  const SoundSpeedProfile bending({{0.0, 1500.0}, {100.0, 1480.0}});
  const EigenrayEnds shadow{
      .source_depth_m = 5, .range_m = 2000, .depth_m = 5, .surface_m = 0.0, .bottom_m = 100.0};
  CHECK(!find_eigenray(bending, shadow));
  CHECK(!find_near_eigenray(bending, shadow));
  CHECK_THROWS_AS(find_eigenray(bending, {.range_m = 0.0}), std::invalid_argument);
  CHECK_THROWS_AS(find_eigenray(bending, {.source_depth_m = -1, .range_m = 9, .surface_m = 0}),
                  std::invalid_argument);
  CHECK_THROWS_AS(SoundRay(bending, 5.0, 1.0, 0.1), std::invalid_argument);
  CHECK_THROWS_AS(SoundRay(bending, 5.0, -1.0, 0.0), std::invalid_argument);
  CHECK_THROWS_AS(SoundRay(bending, 5.0, 1.0, 0.0, 6.0), std::invalid_argument);
}

namespace {

using Path = std::vector<std::pair<double, double>>;  // ranges and depths

/// The path of one ray in a file of BELLHOP's: its pairs of numbers, without the header's.
std::optional<Path> bellhop_path(const std::string& name) {
  const auto file = ensonify::tests::data_file("bellhop/golden/" + name + ".ray");
  if (!file) return std::nullopt;
  std::ifstream stream(*file);
  Path path;
  for (std::string line; std::getline(stream, line);) {
    std::istringstream fields(line);
    std::pair<double, double> point;
    std::string more;
    if (fields >> point.first >> point.second && !(fields >> more)) path.push_back(point);
  }
  path.erase(path.begin());  // the counts of launch angles
  return path;
}

/// The largest difference in depth at the path's ranges, up to a limit.
double apart_m(const SoundSpeedProfile& profile, double source_m, double launch_deg,
               double bottom_m, const Path& path, double up_to_m) {
  SoundRay ray(profile, source_m, std::cos(launch_deg * degree), std::sin(launch_deg * degree), 0.0,
               bottom_m);
  double max_m = 0.0;
  for (const auto& [range_m, depth_m] : path)
    if (range_m <= up_to_m && range_m > ray.point().range_m)
      max_m = std::max(max_m, std::abs(go(ray, range_m).point().depth_m - depth_m));
  return max_m;
}

/// Between samples as BELLHOP's monotone piecewise cubic: slopes are harmonic means of the
/// neighbouring secants (Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5, 300, 1984).
std::vector<SoundSpeedSample> resampled(const std::vector<SoundSpeedSample>& at, int pieces) {
  const std::size_t n = at.size();
  std::vector<double> h, secant, slope(n);
  for (std::size_t i = 0; i + 1 < n; ++i) {
    h.push_back(at[i + 1].depth_m - at[i].depth_m);
    secant.push_back((at[i + 1].sound_speed_mps - at[i].sound_speed_mps) / h[i]);
  }
  slope.front() = secant.front(), slope.back() = secant.back();
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double a = secant[i - 1], b = secant[i];
    const double w1 = 2.0 * h[i] + h[i - 1], w2 = h[i] + 2.0 * h[i - 1];
    slope[i] = a * b > 0.0 ? (w1 + w2) / (w1 / a + w2 / b) : 0.0;
  }
  std::vector<SoundSpeedSample> out = {at.front()};
  for (std::size_t i = 0; i + 1 < n; ++i)
    for (int k = 1; k <= pieces; ++k) {
      const double x = double(k) / pieces;
      const double c = at[i].sound_speed_mps * (1 + 2 * x) * (1 - x) * (1 - x) +
                       at[i + 1].sound_speed_mps * x * x * (3 - 2 * x) +
                       h[i] * x * (1 - x) * (slope[i] * (1 - x) - slope[i + 1] * x);
      out.push_back({at[i].depth_m + x * h[i], c});
    }
  return out;
}

}  // namespace

TEST_CASE(
    "BELLHOP's ray through four layers is reproduced within a millimetre, bottom bounce included") {
  const auto path = bellhop_path("CLinear_one_ray");
  if (!path) {
    WARN("skipped: the data folder has no bellhop/golden");
    return;
  }
  const SoundSpeedProfile profile(
      {{0.0, 1500.0}, {300.0, 1480.0}, {700.0, 1520.0}, {1000.0, 1500.0}});
  REQUIRE(path->size() == 522);
  const double max_m = apart_m(profile, 500.0, 10.0, 1000.0, *path, 5100.0);
  CAPTURE(max_m);
  CHECK(max_m < 1e-3);
}

// Its steps are up to 500 m long there, through a speed that is not linear: 8.0 m apart at 10 km,
// and 11.5 m where the samples are joined by straight lines.
TEST_CASE("BELLHOP's coarse ray through a smooth profile, resampled, is reproduced within metres") {
  const auto path = bellhop_path("MunkP_one_ray");
  if (!path) {
    WARN("skipped: the data folder has no bellhop/golden");
    return;
  }
  const std::vector<SoundSpeedSample> samples = {
      {0, 1548.52},    {200, 1530.29},  {250, 1526.69},  {400, 1517.78},  {600, 1509.49},
      {800, 1504.30},  {1000, 1501.38}, {1200, 1500.14}, {1400, 1500.12}, {1600, 1501.02},
      {1800, 1502.57}, {2000, 1504.62}, {2200, 1507.02}, {2400, 1509.69}, {2600, 1512.55},
      {2800, 1515.56}, {3000, 1518.67}, {3200, 1521.85}, {3400, 1525.10}, {3600, 1528.38},
      {3800, 1531.70}, {4000, 1535.04}, {4200, 1538.39}, {4400, 1541.76}, {4600, 1545.14},
      {4800, 1548.52}, {5000, 1551.91}};
  const SoundSpeedProfile profile(resampled(samples, 200));
  const double max_m = apart_m(profile, 1000.0, -20.0, 5000.0, *path, 10100.0);
  CAPTURE(max_m);
  CHECK(max_m < 9.0);
}
