#include <ensonify/engine/sonar/echo/echo_kernel.h>

#include <cmath>
#include <vector>

#include "support/beds.h"
#include "support/catch.h"
#include "support/targets.h"

using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

constexpr double max_growth = 0.02;

/// Runs of 30 rays each over level ground 10 m below a sonar, in a plane that hangs straight down.
struct LevelRuns {
  RayLayout layout = make_ray_layout(plain_sonar(), 0.00375, 5.0);
  std::vector<std::uint32_t> begin, end;
  std::vector<double> level, pole;

  LevelRuns() {
    const double depression_rad = layout.grid->middle_depression_rad;
    for (std::uint32_t j = 0; j + 30 < layout.grid->elevation_rad.size(); j += 30) {
      begin.push_back(j);
      end.push_back(j + 30);
      level.push_back(-std::sin(depression_rad));
      pole.push_back(std::cos(depression_rad));
    }
  }
  /// How much the range grows per ray at a run's middle, as a share of it: 10 m / sin(depression)
  /// grows by cot(depression) per radian.
  double growth_per_ray(std::size_t run) const {
    const double from_rad = layout.edge_rad[begin[run]], until_rad = layout.edge_rad[end[run]];
    const double middle_rad = layout.grid->elevation_rad[begin[run] + 14] / 2.0 +
                              layout.grid->elevation_rad[begin[run] + 15] / 2.0;
    return std::abs(until_rad - from_rad) / 30.0 /
           std::tan(layout.grid->middle_depression_rad - middle_rad);
  }
  std::vector<std::uint32_t> limits() const {
    std::vector<std::uint32_t> max_rays(begin.size() + lane_padding);
    std::vector<double> levels = level, poles = pole;
    levels.resize(max_rays.size());
    poles.resize(max_rays.size());
    std::vector<std::uint32_t> begins = begin, ends = end;
    begins.resize(max_rays.size());
    ends.resize(max_rays.size());
    limit_runs(
        {.count = begin.size(),
         .begin = begins.data(),
         .end = ends.data(),
         .level = levels.data(),
         .pole = poles.data(),
         .rays = {.edge_rad = layout.edge_rad.data(), .directions = layout.directions.data()},
         .max_growth = max_growth},
        max_rays.data());
    max_rays.resize(begin.size());
    return max_rays;
  }
};

}  // namespace

TEST_CASE("runs are cut where their range grows by more than the limit, and no earlier") {
  const LevelRuns runs;
  const std::vector<std::uint32_t> limits = runs.limits();
  std::size_t cut = 0, whole = 0;
  for (std::size_t i = 0; i < limits.size(); ++i) {
    const double growth = runs.growth_per_ray(i);
    if (!(growth > 0.0)) break;  // a ray that looks up
    const std::uint32_t rays = limits[i];
    CAPTURE(i, rays, growth);
    if (rays > 1) CHECK(rays * growth <= max_growth * (1 + 1e-9));
    if (rays < 30) CHECK((rays + 1) * growth > max_growth * (1 - 1e-9));
    REQUIRE(rays >= 1);
    REQUIRE(rays <= 30);
    ++(rays < 30 ? cut : whole);
  }
  CHECK(cut > 5);
  CHECK(whole > 5);
}

TEST_CASE("runs are cut at the same rays on every instruction set") {
  const LevelRuns runs;
  const std::vector<std::uint32_t> expected = runs.limits();
  on_each_target([&] { CHECK(runs.limits() == expected); });
}
