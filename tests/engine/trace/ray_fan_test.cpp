#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "support/catch.h"

#include <ensonify/engine/trace/beam_ranges.h>
#include <ensonify/engine/trace/ray_fan.h>

using namespace ensonify::engine;

namespace {

const FanLayout layout{.sector_low_rad = -0.17,
                       .sector_high_rad = 1.5,
                       .truncation_rad = 0.01,
                       .main_lobe_rad = 0.01,
                       .planes = 8,
                       .elevations = 1000,
                       .range_over_height = 8.0};

}  // namespace

TEST_CASE("a fan's elevations ascend from one end of the sector to the other") {
  const FanGrid grid(layout);
  CHECK(grid.middle_depression_rad - grid.elevation_rad.front() == Approx(1.5));
  CHECK(grid.middle_depression_rad - grid.elevation_rad.back() == Approx(-0.17));
  for (std::size_t j = 1; j < grid.elevation_rad.size(); ++j)
    REQUIRE(grid.elevation_rad[j] > grid.elevation_rad[j - 1]);
}

TEST_CASE("no step between elevations is longer than five even ones, wherever the fan looks") {
  // A fifth of the rays are even in angle over the whole sector.
  for (const double tilt_rad : {-0.3, 0.0, 0.2})
    for (const double range_over_height : {0.01, 1.0, 3.0, 40.0})
      for (const double rise_rad : {0.0, 0.1})
        for (const auto& [low_rad, high_rad] :
             {std::pair{0.0, 1.57}, {-1.5, 1.5}, {-0.2, 0.2}, {0.3, 1.0}}) {
          FanLayout turned = layout;
          turned.sector_low_rad = low_rad, turned.sector_high_rad = high_rad;
          turned.range_over_height = range_over_height;
          turned.roll_tilt_rad = tilt_rad, turned.rise_rad = rise_rad;
          const FanGrid grid(turned);
          const double even_rad = (high_rad - low_rad) / (turned.elevations - 1);
          CAPTURE(tilt_rad, range_over_height, rise_rad, low_rad);
          for (std::size_t j = 1; j < grid.elevation_rad.size(); ++j) {
            const double step_rad = grid.elevation_rad[j] - grid.elevation_rad[j - 1];
            REQUIRE(step_rad >= 0.0);
            REQUIRE(step_rad <= 5.0 * even_rad * (1.0 + 1e-6));
          }
        }
}

TEST_CASE("two thirds of a fan's elevations are even in range over a flat bed") {
  const FanGrid grid(layout);
  std::size_t within = 0;
  double widest = 0.0, previous = 0.0;
  for (double e : grid.elevation_rad) {
    const double depression = grid.middle_depression_rad - e;
    const double range = 1.0 / std::sin(depression);
    if (depression <= std::asin(1.0 / 8.0) || range > 8.0) break;
    if (++within > 1) widest = std::max(widest, range - previous);
    previous = range;
  }
  CHECK(within >= 650);
  // Even steps of the range part alone would be this wide; the angular part only narrows them.
  CHECK(widest <= (8.0 - 1.0 / std::sin(1.5)) / (0.65 * 999) * (1 + 1e-6));
}

TEST_CASE("a fan that reaches past nadir is as even in range there as before it") {
  FanLayout past = layout;
  past.sector_high_rad = 2.3;
  for (const double range_over_height : {1.2, 2.0, 8.0})
    for (const double tilt_rad : {-0.1, 0.0, 0.1}) {
      past.range_over_height = range_over_height;
      past.roll_tilt_rad = tilt_rad;
      const FanGrid grid(past);
      const double end = std::min(1.0 / std::sin(2.3 + tilt_rad), range_over_height);
      const double share = (end - 1.0 + range_over_height - 1.0) / (0.65 * 999) * (1.0 + 1e-6);
      double previous = 0.0;
      for (const double elevation : grid.elevation_rad) {
        const double depression = grid.middle_depression_rad - elevation + tilt_rad;
        const double range = 1.0 / std::sin(depression);
        if (depression < std::asin(1.0 / range_over_height)) break;
        CAPTURE(range_over_height, tilt_rad, depression);
        if (previous > 0.0 && std::max(range, previous) <= range_over_height)
          REQUIRE(std::abs(range - previous) <= share);
        previous = range;
      }
    }
}

TEST_CASE(
    "a ray's sine from broadside is cos(elevation) sin(azimuth), and directions are unit vectors") {
  const auto grid = std::make_shared<const FanGrid>(layout);
  const RayFan fan{
      grid, {1, 2, 3}, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ(),
      10.0};
  for (std::size_t k = 0; k < fan.planes(); ++k)
    for (std::size_t j = 0; j < fan.elevations(); j += 37) {
      const Eigen::Vector3d d = fan.ray(k, j).direction;
      CHECK(d.norm() == Approx(1.0));
      CHECK(d.dot(fan.array_axis) ==
            Approx(grid->cos_elevation[j] * grid->planes[k].sin_azimuth).margin(1e-15));
    }
}

TEST_CASE("planes are even across the main lobe, symmetric, and reach the truncation angle") {
  const FanGrid grid(layout);
  double total = 0.0;
  std::size_t even = 0;
  for (std::size_t k = 0; k < grid.planes.size(); ++k) {
    total += grid.planes[k].width_rad;
    CHECK(grid.planes[k].sin_azimuth ==
          Approx(-grid.planes[grid.planes.size() - 1 - k].sin_azimuth));
    even += std::abs(grid.planes[k].width_rad - 0.02 / 8) < 1e-12;
  }
  CHECK(even == 8);
  const double steepest = std::cos(grid.elevation_rad.back());
  CHECK(std::sin(0.5 * total) * steepest == Approx(std::sin(0.01)));
}

TEST_CASE("few planes cover a beam that is wider than its main lobe, as near a long array") {
  FanLayout near = layout;
  near.main_lobe_rad = 0.001;
  near.main_beam_rad = near.truncation_rad = 0.3;
  for (const int planes : {2, 4}) {
    near.planes = planes;
    CHECK(FanGrid(near).planes.size() <= 20);
  }
}

TEST_CASE("the solid angles of a fan's rays fill the part of the sphere it covers") {
  FanLayout wide = layout;
  wide.truncation_rad = 0.3;
  wide.main_lobe_rad = 0.3;
  wide.planes = 400;
  const FanGrid grid(wide);
  double filled = 0.0;
  for (std::size_t k = 0; k < grid.planes.size(); ++k)
    for (std::size_t j = 1; j < grid.elevation_rad.size(); ++j)
      if (grid.within_beam(k, j) && grid.within_beam(k, j - 1))
        filled += grid.planes[k].width_rad * 0.5 *
                  (grid.cos_elevation[j] + grid.cos_elevation[j - 1]) *
                  (grid.elevation_rad[j] - grid.elevation_rad[j - 1]);
  // |psi| <= t cuts the zone of height 2 sin(t) out of the sphere; the sector takes 1.67 rad of its
  // rotation about the array.
  const double zone = 2.0 * std::sin(0.3) * 1.67;
  CHECK(filled == Approx(zone).epsilon(0.03));
}

TEST_CASE("an invalid fan layout is refused") {
  for (auto spoil : {+[](FanLayout& l) { l.sector_high_rad = l.sector_low_rad; },
                     +[](FanLayout& l) { l.sector_high_rad = l.sector_low_rad + std::numbers::pi; },
                     +[](FanLayout& l) { l.planes = 7; }, +[](FanLayout& l) { l.elevations = 1; },
                     +[](FanLayout& l) { l.truncation_rad = std::nan(""); }}) {
    FanLayout bad = layout;
    spoil(bad);
    CHECK_THROWS_AS(FanGrid(bad), std::invalid_argument);
  }
}

TEST_CASE("a tilted fan still covers its far range, like a level one") {
  // The share of rays that meet a flat bed in the outer half of the range.
  const auto far_share = [](double roll_tilt_rad, double laid_for_rad) {
    const FanGrid grid({.sector_low_rad = -0.2,
                        .sector_high_rad = 1.5,
                        .truncation_rad = 0.01,
                        .main_lobe_rad = 0.01,
                        .range_over_height = 8.0,
                        .roll_tilt_rad = laid_for_rad});
    int far = 0;
    for (const double elevation : grid.elevation_rad) {
      const double depression = grid.middle_depression_rad - elevation + roll_tilt_rad;
      far += depression < std::asin(1.0 / 4.0) && depression > std::asin(1.0 / 8.0);
    }
    return static_cast<double>(far) / static_cast<double>(grid.elevation_rad.size());
  };
  const double level = far_share(0.0, 0.0);
  CHECK(level > 0.35);
  for (const double roll_tilt_rad : {-0.1, 0.1}) {
    CHECK(far_share(roll_tilt_rad, roll_tilt_rad) == Approx(level).epsilon(0.1));
    CHECK(far_share(roll_tilt_rad, 0.0) < 0.8 * level);  // laid out as if it were level
  }
}

TEST_CASE("where the bed comes up above the sonar, two fifths of the rays are even over a slope") {
  FanLayout rises = layout;
  rises.rise_rad = 0.15;
  const double slope_rad = 0.15 + std::asin(1.0 / 8.0);
  const auto widest_step = [&](const FanGrid& grid) {  // over the slope, in sonar's heights
    double widest = 0.0, previous = 1.0;
    for (const double elevation : grid.elevation_rad) {
      const double range = 1.0 / std::sin(grid.middle_depression_rad - elevation + slope_rad);
      if (range > 8.0 || range < 0.0) break;
      if (elevation > grid.elevation_rad.front()) widest = std::max(widest, range - previous);
      previous = range;
    }
    return widest;
  };
  CHECK(widest_step(FanGrid(rises)) <= 7.0 / (0.45 * 999));
  CHECK(widest_step(FanGrid(layout)) > 0.1);
}

TEST_CASE("the ranges within the beam and those outside alternate and are all rays of a plane") {
  const FanGrid grid(layout);
  std::size_t ranges_within = 0, ranges_outside = 0;
  for (std::size_t plane = 0; plane < grid.planes.size(); ++plane) {
    std::vector<int> within(grid.elevation_rad.size(), -1);
    std::size_t end = 0;
    for_beam_ranges(grid, plane, [&](std::size_t from, std::size_t until, bool are_within) {
      REQUIRE(from < until);
      REQUIRE(until <= within.size());
      REQUIRE(from == end);
      if (from > 0) REQUIRE(within[from - 1] == !are_within);
      for (std::size_t j = from; j < until; ++j) within[j] = are_within;
      end = until;
      ++(are_within ? ranges_within : ranges_outside);
    });
    for (std::size_t j = 0; j < within.size(); ++j)
      REQUIRE(within[j] == int(grid.within_beam(plane, j)));
  }
  CHECK(ranges_within >= grid.planes.size());
  CHECK(ranges_outside > 0);
}
