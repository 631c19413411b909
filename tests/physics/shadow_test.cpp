#include <cmath>

#include "physics/above_bed.h"
#include "support/beds.h"
#include "support/catch.h"

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

constexpr double height_m = 10.0;  // of the sonar over the bed

double slant_m(double ground_m) { return std::hypot(ground_m, height_m); }

}  // namespace

TEST_CASE("a wall's shadow begins behind its foot and ends at X h / (h - t)") {
  const Sonar sonar = plain_sonar();
  const double wall_m = 30.0, shape_height_m = 2.0, thick_m = 0.05;
  Seafloor bed = level_bed(20.0);
  add_box(bed, {30.0f, -20.0f, -20.0f}, {30.05f, 20.0f, -18.0f});
  const auto lines = ping_once(sonar, bed, above_bed, height_m);
  const EchoLine& starboard = lines[1];

  // The far upper edge casts the shadow.
  const double end_m = slant_m((wall_m + thick_m) * height_m / (height_m - shape_height_m));
  std::size_t last_dark = 0, first_dark = starboard.bins.region.size();
  for (std::size_t i = 0; i < starboard.bins.region.size(); ++i)
    if (is(starboard, i, Region::shadow)) {
      last_dark = i;
      first_dark = std::min(first_dark, i);
      CHECK(starboard.bins.shadow_instance[i] == 7);
    }
  CHECK(std::abs((static_cast<double>(last_dark) + 1.0) * sonar.bin_m() - end_m) <=
        2 * sonar.bin_m());
  CHECK(std::abs(static_cast<double>(first_dark) * sonar.bin_m() - slant_m(wall_m)) <=
        2 * sonar.bin_m());
  for (std::size_t i = first_dark + 2; i + 2 <= last_dark; ++i)
    REQUIRE(starboard.bins.intensity_mean[i] == 0.0f);

  // The wall is nearer than its foot, at the ranges of the bed in front: bright, and layover.
  const std::size_t top = bin_at(sonar, std::hypot(wall_m, height_m - shape_height_m)) + 2;
  CHECK(is(starboard, top, Region::object));
  CHECK(starboard.bins.layover[top] == 1);
  CHECK(starboard.bins.instance[top] == 7);
  CHECK(starboard.bins.intensity_mean[top] > 5.0f * starboard.bins.intensity_mean[top - 10]);

  // The wall has no effect on the other side.
  for (std::size_t i = 0; i < lines[0].bins.region.size(); ++i) {
    REQUIRE(!is(lines[0], i, Region::shadow));
    REQUIRE(lines[0].bins.instance[i] == 0);
  }
}

TEST_CASE("under roll a side keeps its ranges and shadows, and the beam is tilted") {
  Sonar sonar = plain_sonar();
  Seafloor bed = level_bed(20.0);
  add_box(bed, {30.0f, -20.0f, -20.0f}, {30.05f, 20.0f, -18.0f});
  const auto level = ping_once(sonar, bed, above_bed, height_m);
  for (const double roll_rad : {-0.15, -0.05, 0.05, 0.15}) {
    CAPTURE(roll_rad);
    Pose rolled = above_bed;
    rolled.roll_rad = roll_rad;
    const auto lines = ping_once(sonar, bed, rolled, height_m);
    for (const std::size_t side : {0u, 1u}) {
      std::size_t differ = 0;
      for (std::size_t i = bin_at(sonar, slant_m(3.0)); i < lines[side].bins.region.size(); ++i)
        differ += lines[side].bins.region[i] != level[side].bins.region[i];
      // The sector reaches from 10 degrees above to 90 below the sonar's own horizon, so the
      // far bed is covered at each of these rolls.
      CHECK(differ <= 4);
      // A side that reaches beyond nadir meets the nearest bed; the side that is rolled up misses
      // it.
      const bool up = (side == 1) == (roll_rad < 0.0);
      const double nearest_m = up ? height_m / std::cos(roll_rad) : height_m;
      CHECK(lines[side].first_return * sonar.bin_m() ==
            Approx(nearest_m).margin(2 * sonar.bin_m()));
      for (const double range_m : {15.0, 40.0, 60.0})
        CHECK(lines[side].bins.intensity_mean[bin_at(sonar, range_m)] ==
              Approx(level[side].bins.intensity_mean[bin_at(sonar, range_m)]).epsilon(0.02));
    }
    CHECK(is(lines[1], bin_at(sonar, slant_m(30.05 * height_m / 8.0)) - 3, Region::shadow));
  }

  // With a real vertical beam, its axis 20 degrees down: when rolled to starboard, the far range
  // of starboard leaves the beam, and the far range of port comes nearer to the axis.
  const auto plain = ping_once({}, bed, above_bed, height_m);
  Pose rolled = above_bed;
  rolled.roll_rad = 0.15;
  const auto tilted = ping_once({}, bed, rolled, height_m);
  const std::size_t far = bin_at(sonar, 60.0);
  const VerticalPattern beam;
  const double depression_rad = std::asin(height_m / 60.0);
  for (const auto& [side, tilt_rad] : {std::pair{0u, -0.15}, std::pair{1u, 0.15}}) {
    const double change = beam.power(depression_rad - tilt_rad, sidescan_sectors[side]) /
                          beam.power(depression_rad, sidescan_sectors[side]);
    CHECK(tilted[side].bins.intensity_mean[far] / plain[side].bins.intensity_mean[far] ==
          Approx(change * change).epsilon(0.02));
  }
}

TEST_CASE("a pitched array looks obliquely: its first return comes from h / cos(pitch)") {
  const Sonar sonar = plain_sonar();
  const Seafloor bed = level_bed(20.0);
  for (const double pitch_rad : {-0.36, 0.2}) {
    Pose pitched = above_bed;
    pitched.pitch_rad = pitch_rad;
    const auto lines = ping_once(sonar, bed, pitched, height_m);
    for (const EchoLine& line : lines) {
      // The beam, 0.4 degrees to its first null on either side, meets the bed slightly nearer.
      const double null_rad = 0.0075;
      CHECK(line.first_return * sonar.bin_m() ==
            Approx(height_m / std::cos(std::abs(pitch_rad) - null_rad)).margin(2 * sonar.bin_m()));
      const std::size_t bin = bin_at(sonar, 30.0);
      // It lies ahead of the sonar when the nose is up and behind when it is down, in the array's
      // broadside plane.
      const double down_m = height_m, forward_m = line.bins.y_m[bin];
      CHECK(std::abs(forward_m * std::cos(pitch_rad) - down_m * std::sin(pitch_rad)) < 0.05);
    }
  }
}

TEST_CASE("under pitch the first return and a wall's shadow lie in the array's inclined plane") {
  const Sonar sonar = plain_sonar();
  const double wall_m = 30.0, shape_height_m = 2.0, thick_m = 0.05;
  Seafloor bed = level_bed(20.0);
  add_box(bed, {30.0f, -40.0f, -20.0f}, {30.05f, 40.0f, -18.0f});
  for (const double pitch_rad : {-0.35, 0.1, 0.25}) {
    Pose pose = above_bed;
    pose.pitch_rad = pitch_rad;
    const auto lines = ping_once(sonar, bed, pose, height_m);
    CAPTURE(pitch_rad);
    // The nearest edge of the beam, which is asin(lambda / L) wide, has a slightly shorter range.
    const double psi_rad = std::asin(0.00375 / sonar.array_length_m);
    for (const EchoLine& line : lines) {
      const double first_m = line.first_return * sonar.bin_m();
      CHECK(first_m < height_m / std::cos(pitch_rad) + 2 * sonar.bin_m());
      CHECK(first_m > height_m / std::cos(std::abs(pitch_rad) - psi_rad) - 2 * sonar.bin_m());
    }
    std::size_t last_dark = 0;
    for (std::size_t i = 0; i < lines[1].bins.region.size(); ++i)
      if (is(lines[1], i, Region::shadow)) last_dark = i;
    const double end_m = std::hypot((wall_m + thick_m) * height_m / (height_m - shape_height_m),
                                    height_m / std::cos(pitch_rad));
    CHECK(std::abs((static_cast<double>(last_dark) + 1.0) * sonar.bin_m() - end_m) <=
          4 * sonar.bin_m());
  }
}

TEST_CASE("a wall higher than the sonar hides everything behind it") {
  const Sonar sonar = plain_sonar();
  Seafloor bed = level_bed(20.0);
  add_box(bed, {30.0f, -20.0f, -20.0f}, {30.5f, 20.0f, -1.0f});
  const auto lines = ping_once(sonar, bed, above_bed, height_m);
  for (std::size_t i = bin_at(sonar, slant_m(30.0)) + 2; i < lines[1].bins.region.size(); ++i)
    REQUIRE(is(lines[1], i, Region::shadow));
}

TEST_CASE("a shadow up to the last bin is a shadow, the water beyond the seafloor is not") {
  const Sonar sonar = plain_sonar();
  Seafloor bed = level_bed(20.0, 60.0);  // ends 60 m out
  const auto open = ping_once(sonar, bed, above_bed, height_m);
  add_box(bed, {40.0f, -20.0f, -20.0f}, {41.0f, 20.0f, -14.0f});
  const auto hidden = ping_once(sonar, bed, above_bed, height_m);
  for (const double ground_m : {45.0, 59.0}) {
    CHECK(is(open[1], bin_at(sonar, slant_m(ground_m)), Region::seabed));
    CHECK(is(hidden[1], bin_at(sonar, slant_m(ground_m)), Region::shadow));
  }
  for (const double ground_m : {62.0, 70.0}) {
    CHECK(is(open[1], bin_at(sonar, slant_m(ground_m)), Region::no_data));
    CHECK(is(hidden[1], bin_at(sonar, slant_m(ground_m)), Region::no_data));
  }
  CHECK(open[1].starved > 0);
}

TEST_CASE("a hole in the bed is no data, not shadow") {
  const Sonar sonar = plain_sonar();
  Seafloor bed;  // a strip with a gap from 30 to 35 m to starboard
  bed.labels = {{1, 1, 0}};
  for (const auto& [from, to] : {std::pair{-200.0f, 30.0f}, std::pair{35.0f, 200.0f}}) {
    const auto n = static_cast<std::uint32_t>(bed.mesh.positions.size());
    for (const Eigen::Vector3f& p :
         {Eigen::Vector3f{from, -200, -20}, Eigen::Vector3f{to, -200, -20},
          Eigen::Vector3f{to, 200, -20}, Eigen::Vector3f{from, 200, -20}})
      bed.mesh.positions.push_back(p);
    bed.mesh.faces.push_back({n, n + 1, n + 2});
    bed.mesh.faces.push_back({n, n + 2, n + 3});
  }
  const auto lines = ping_once(sonar, bed, above_bed, height_m);
  for (std::size_t i = bin_at(sonar, slant_m(30.0)) + 2; i < bin_at(sonar, slant_m(35.0)) - 1; ++i)
    REQUIRE(is(lines[1], i, Region::no_data));
}

TEST_CASE("the underside of a body makes neither an echo nor a shadow") {
  const Sonar sonar = plain_sonar();
  Seafloor bed = level_bed(20.0, 30.0);  // ends 30 m out; a shelf hangs beyond that
  const auto n = static_cast<std::uint32_t>(bed.mesh.positions.size());
  for (const Eigen::Vector3f& p : {Eigen::Vector3f{35, -200, -5}, Eigen::Vector3f{200, -200, -5},
                                   Eigen::Vector3f{200, 200, -5}, Eigen::Vector3f{35, 200, -5}})
    bed.mesh.positions.push_back(p);
  bed.mesh.faces.push_back({n, n + 1, n + 2});
  bed.mesh.faces.push_back({n, n + 2, n + 3});
  const auto lines = ping_once(sonar, bed, above_bed, height_m);
  for (std::size_t i = bin_at(sonar, slant_m(30.0)) + 2; i < lines[1].bins.region.size(); ++i) {
    REQUIRE(is(lines[1], i, Region::no_data));
    REQUIRE(lines[1].bins.intensity_mean[i] == 0.0f);
  }
}
