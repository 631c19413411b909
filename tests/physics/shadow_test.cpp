#include <cmath>

#include "support/beds.h"
#include "support/catch.h"

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

constexpr double height_m = 10.0;  // of the sonar over the bed
const Pose above_bed{.position = {0.0, 0.0, -10.0}};

double slant_m(double ground_m) { return std::hypot(ground_m, height_m); }

std::size_t bin_at(const Sonar& sonar, double range_m) {
  return static_cast<std::size_t>(range_m / sonar.bin_m());
}

bool is(const EchoLine& line, std::size_t bin, Region region) {
  return line.bins.region[bin] == static_cast<std::uint32_t>(region);
}

}  // namespace

TEST_CASE("a wall's shadow begins behind its foot and ends at X h / (h - t)") {
  const Sonar sonar = plain_sonar();
  const double wall_m = 30.0, tall_m = 2.0, thick_m = 0.05;
  Seafloor bed = level_bed(20.0);
  add_box(bed, {30.0f, -20.0f, -20.0f}, {30.05f, 20.0f, -18.0f});
  const auto lines = ping_once(sonar, bed, above_bed, height_m);
  const EchoLine& starboard = lines[1];

  // The far upper edge casts the shadow.
  const double end_m = slant_m((wall_m + thick_m) * height_m / (height_m - tall_m));
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

  // The wall stands nearer than its foot, over the bed in front: bright, and layover.
  const std::size_t top = bin_at(sonar, std::hypot(wall_m, height_m - tall_m)) + 2;
  CHECK(is(starboard, top, Region::object));
  CHECK(starboard.bins.layover[top] == 1);
  CHECK(starboard.bins.instance[top] == 7);
  CHECK(starboard.bins.intensity_mean[top] > 5.0f * starboard.bins.intensity_mean[top - 10]);

  // Nothing of it on the other side.
  for (std::size_t i = 0; i < lines[0].bins.region.size(); ++i) {
    REQUIRE(!is(lines[0], i, Region::shadow));
    REQUIRE(lines[0].bins.instance[i] == 0);
  }
}

TEST_CASE("under pitch the first return and a wall's shadow lie in the array's slanted plane") {
  const Sonar sonar = plain_sonar();
  const double wall_m = 30.0, tall_m = 2.0, thick_m = 0.05;
  Seafloor bed = level_bed(20.0);
  add_box(bed, {30.0f, -40.0f, -20.0f}, {30.05f, 40.0f, -18.0f});
  for (const double pitch_rad : {-0.35, 0.1, 0.25}) {
    Pose pose = above_bed;
    pose.pitch_rad = pitch_rad;
    const auto lines = ping_once(sonar, bed, pose, height_m);
    CAPTURE(pitch_rad);
    // The nearest edge of the beam, which is asin(lambda / L) wide, reaches a little less far.
    const double psi_rad = std::asin(0.00375 / sonar.array_length_m);
    for (const EchoLine& line : lines) {
      const double first_m = line.first_return * sonar.bin_m();
      CHECK(first_m < height_m / std::cos(pitch_rad) + 2 * sonar.bin_m());
      CHECK(first_m > height_m / std::cos(std::abs(pitch_rad) - psi_rad) - 2 * sonar.bin_m());
    }
    std::size_t last_dark = 0;
    for (std::size_t i = 0; i < lines[1].bins.region.size(); ++i)
      if (is(lines[1], i, Region::shadow)) last_dark = i;
    const double end_m = std::hypot((wall_m + thick_m) * height_m / (height_m - tall_m),
                                    height_m / std::cos(pitch_rad));
    CHECK(std::abs((static_cast<double>(last_dark) + 1.0) * sonar.bin_m() - end_m) <=
          4 * sonar.bin_m());
  }
}

TEST_CASE("under roll the shadow stays, and the first return is where the sector still looks") {
  const Sonar sonar = plain_sonar();
  Seafloor bed = level_bed(20.0);
  add_box(bed, {30.0f, -20.0f, -20.0f}, {30.05f, 20.0f, -18.0f});
  const auto level = ping_once(sonar, bed, above_bed, height_m);
  for (const double roll_rad : {-0.12, 0.12}) {
    Pose pose = above_bed;
    pose.roll_rad = roll_rad;  // lowers starboard, whose sector's end then looks past nadir
    const auto lines = ping_once(sonar, bed, pose, height_m);
    CAPTURE(roll_rad);
    for (const Side side : {Side::port, Side::starboard}) {
      const double lowered_rad = side == Side::starboard ? roll_rad : -roll_rad;
      const double first_m = lowered_rad >= 0.0 ? height_m : height_m / std::cos(lowered_rad);
      const EchoLine& line = lines[static_cast<std::size_t>(side)];
      CHECK(std::abs(line.first_return * sonar.bin_m() - first_m) <= 2 * sonar.bin_m());
    }
    std::size_t differ = 0;
    for (std::size_t i = bin_at(sonar, slant_m(25.0)); i < lines[1].bins.region.size(); ++i)
      differ += is(lines[1], i, Region::shadow) != is(level[1], i, Region::shadow);
    CHECK(differ <= 4);
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

TEST_CASE("a shadow that outlasts the range is a shadow, the water beyond the seafloor is not") {
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

TEST_CASE("the underside of something is neither an echo nor a shadow's cause") {
  const Sonar sonar = plain_sonar();
  Seafloor bed = level_bed(20.0, 30.0);  // ends 30 m out; a shelf hangs over what would follow
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
