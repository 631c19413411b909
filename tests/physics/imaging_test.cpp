// The laws of a sonar that looks ahead: its beams over bearing, their levels, speckle and shadows.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "physics/looks_ahead.h"
#include "support/catch.h"
#include "support/parsed_scene.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/sonar/instrument/mounting.h>
#include <ensonify/engine/sonar/instrument/shading.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;
using scatter::to_db;

namespace {

/// The intensity over its expected value, of beams and bins on a level bed.
std::vector<std::vector<double>> speckle(const std::vector<EchoLine>& lines, std::size_t from_bin,
                                         std::size_t until_bin) {
  std::vector<std::vector<double>> all;
  for (const EchoLine& line : lines) {
    std::vector<double>& row = all.emplace_back();
    for (std::size_t bin = from_bin; bin < until_bin; ++bin)
      row.push_back(double(line.bins.intensity[bin]) / double(line.bins.intensity_mean[bin]));
  }
  return all;
}

/// The correlation of two sets of values with mean 1.
double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += (a[i] - 1.0) * (b[i] - 1.0);
    squares += 0.5 * ((a[i] - 1.0) * (a[i] - 1.0) + (b[i] - 1.0) * (b[i] - 1.0));
  }
  return sum / squares;
}

}  // namespace

TEST_CASE("a point has the pattern of the transmitter and of the steered receiver over the beams") {
  // A glint, and a body that scatters diffusely and is a hundredth of a beam wide. (A wider one
  // fills the nulls: it is not a point.)
  struct Body {
    const char* material;
    double diameter_m;
  };
  const Body body = GENERATE(Body{"smooth", 0.2}, Body{"rough", 0.004});
  const char* shading = GENERATE("uniform", "taylor");
  const double bearing_deg = GENERATE(0.0, 30.0, 60.0), tilt_deg = GENERATE(0.0, 8.0);
  CAPTURE(body.material, shading, bearing_deg, tilt_deg);
  const double bearing_rad = bearing_deg * degree;
  const Scene scene =
      parsed(level_scene(100.0, fmt::format(R"(receive_shading = "{}"
[[objects]]
shape = "sphere"
diameter_m = {}
east_m = {}
north_m = {}
height_m = {}
material = "{}"
[material.smooth]
model = "solid"
like = "steel"
diffuse_db = -100
[material.rough]
model = "lambert"
)",
                                            shading, body.diameter_m, 15.0 * std::sin(bearing_rad),
                                            15.0 * std::cos(bearing_rad),
                                            90.0 - 0.5 * body.diameter_m, body.material)),
             {"speckle=false"});
  Simulator simulator(scene);
  Pose pose = over_bed(100.0, 90.0);
  pose.roll_rad = tilt_deg * degree;
  pose.pitch_rad = 0.5 * tilt_deg * degree;
  const auto lines = ping(simulator, pose);
  const Sonar& sonar = simulator.sonars()[0];
  const LineArray receiver = sonar.receive_array(simulator.sound_speed_mps() / sonar.frequency_hz);
  const Eigen::Vector3d axis = body_to_world(mounted(pose, sonar.beam_mounting(0))).col(0);
  const double to_point =
      axis.dot(Eigen::Vector3d(std::sin(bearing_rad), std::cos(bearing_rad), 0.0));
  // All beams have the same transmitter and body, so levels are compared with the strongest.
  std::vector<double> levels;
  for (const EchoLine& line : lines) {
    double& sum = levels.emplace_back(0.0);
    for (auto bin = static_cast<std::size_t>(14.5 / sonar.bin_m()); bin * sonar.bin_m() < 15.2;
         ++bin)
      sum += double(line.bins.intensity_mean[bin]);
  }
  const auto best = static_cast<std::size_t>(std::ranges::max_element(levels) - levels.begin());
  const auto pattern = [&](std::size_t beam) {
    return receiver.power(to_point + std::sin(sonar.bearing_rad(static_cast<int>(beam))));
  };
  // Its bearing: the strongest beam is one of the two nearest to the point.
  const double step = sonar.bearing_rad(1) - sonar.bearing_rad(0);
  CHECK(std::abs(sonar.bearing_rad(static_cast<int>(best)) - std::asin(-to_point)) < step);
  std::size_t compared = 0;
  for (std::size_t beam = 0; beam < lines.size(); ++beam) {
    const double law_db = to_db(pattern(beam) / pattern(best));
    if (law_db < -30.0 || std::abs(double(beam) - double(best)) > 8.0) continue;
    CAPTURE(beam, law_db);
    CHECK(std::abs(to_db(levels[beam] / levels[best]) - law_db) < 0.02);
    ++compared;
  }
  CHECK(compared >= 5);
}

TEST_CASE("the middle beam has the level of a sidescan that looks ahead") {
  const Scene scene = parsed(level_scene(13.0, R"(transmit_beamwidth_deg = 50
[sonar.side]
sides = "starboard"
mount_azimuth_deg = -90
frequency_hz = 750e3
source_level_db = 200
pulse = "lfm"
bandwidth_hz = 60e3
pulse_length_s = 1e-3
window = "hann"
range_m = 25
bins = 800
array_length_m = 0.002086
receive_array_length_m = 0.1
focused = true
side_lobes = 3
vertical_beamwidth_deg = 20
tilt_deg = 0
sector_low_deg = -25
sector_high_deg = 25
noise = false
elevations = 512
)"),
                             {"speckle=false", "sonar.ahead.elevations=512"});
  Simulator simulator(scene);
  const auto lines = ping(simulator, over_bed(13.0, 3.0));
  REQUIRE(lines.size() == 258);
  const EchoLine &middle = lines[128], &side = lines[257];
  double most_db = 0.0;
  for (std::size_t bin = 250; bin < 800; ++bin)
    most_db = std::max(most_db, std::abs(to_db(double(middle.bins.intensity_mean[bin]) /
                                               double(side.bins.intensity_mean[bin]))));
  CHECK(most_db < 0.05);
}

TEST_CASE("the speckle of beams is Rayleigh, and overlapping beams share it as their patterns do") {
  const int planes = GENERATE(4, 8);
  CAPTURE(planes);
  const Scene scene = parsed(level_scene(13.0, fmt::format("planes = {}", planes)));
  Simulator simulator(scene);
  const Pose pose = over_bed(13.0, 3.0);
  const auto lines = ping(simulator, pose);
  const auto all = speckle(lines, 300, 780);
  double sum = 0.0, squares = 0.0, count = 0.0;
  for (std::size_t beam = 40; beam < 217; ++beam)
    for (const double value : all[beam]) sum += value, squares += value * value, count += 1.0;
  const double mean = sum / count;
  // Some 40 000 independent values, each with standard deviations of 1 and, of the square, 4.5.
  CHECK(mean == Approx(1.0).margin(0.02));
  CHECK(squares / count - mean * mean == Approx(1.0).margin(0.08));
  // van Cittert and Zernike: the correlation of the fields of two beams is the integral of the
  // product of their fields over the directions, that of intensities its square. For a focused
  // uniform array with all its lobes it is sinc(L (u - u') / lambda); here as many as are traced.
  const Sonar& sonar = simulator.sonars()[0];
  const double per_sine =
      sonar.receive_length_m() * sonar.frequency_hz / simulator.sound_speed_mps();
  const double lobes_x = sonar.side_lobes + 1.0;
  const auto shared = [&](double apart_x) {
    double sum = 0.0;
    for (double x = apart_x - lobes_x + 5e-4; x < lobes_x; x += 1e-3)
      sum += 1e-3 * Shading().far_field(x) * Shading().far_field(x - apart_x);
    return sum;
  };
  const double all_lobes = shared(0.0);
  for (const std::size_t apart : {1u, 2u, 3u}) {
    double found = 0.0, law = 0.0;
    for (std::size_t beam = 40; beam + apart < 217; ++beam) {
      found += correlation(all[beam], all[beam + apart]);
      law +=
          std::pow(shared(per_sine * (std::sin(sonar.bearing_rad(static_cast<int>(beam + apart))) -
                                      std::sin(sonar.bearing_rad(static_cast<int>(beam))))) /
                       all_lobes,
                   2.0);
    }
    CAPTURE(apart);
    CHECK(found / 177.0 == Approx(law / 177.0).margin(0.02));
  }
  // The same pose has the same speckle; half an array aside it is another one.
  Pose aside = pose;
  aside.position.x() += 0.05;
  const auto again = speckle(ping(simulator, pose), 300, 780),
             other = speckle(ping(simulator, aside), 300, 780);
  CHECK(correlation(all[128], again[128]) == Approx(1.0).margin(1e-6));
  double left = 0.0;
  for (std::size_t beam = 108; beam < 149; ++beam) left += correlation(all[beam], other[beam]);
  CHECK(left / 41.0 < 0.1);
}

TEST_CASE("a wall that rises out of a shadow has speckle, and all levels are finite") {
  // Before the wall, bins have no energy of their own, but the wall's pulse reaches into them.
  const Scene scene = parsed(level_scene(13.0, R"([[objects]]
shape = "box"
length_m = 0.2
width_m = 20
tall_m = 2.8
north_m = 8
[[objects]]
shape = "box"
length_m = 1
width_m = 40
tall_m = 8
north_m = 16
material = "steel"
)"));
  Simulator simulator(scene);
  const auto lines = ping(simulator, over_bed(13.0, 3.0));
  std::size_t of_wall = 0;
  for (const EchoLine& line : lines)
    for (std::size_t bin = 0; bin < line.bins.intensity.size(); ++bin) {
      REQUIRE(std::isfinite(line.bins.intensity[bin]));
      of_wall += line.bins.instance[bin] == 2 && line.bins.intensity[bin] > 0.0f;
    }
  CHECK(of_wall > 1000);
}

TEST_CASE("the shadow of a box moves with it") {
  constexpr double height_m = 3.0, tall_m = 1.5, wide_m = 2.0, at_m = 8.0, thick_m = 0.2,
                   speed_mps = 0.5;
  // It looks where it goes, to the east: turned by -90 degrees its width lies across the sight.
  const Scene scene =
      parsed(level_scene(13.0, fmt::format(R"([[objects]]
shape = "box"
length_m = {}
width_m = {}
tall_m = {}
east_m = -3
north_m = {}
heading_deg = -90
path = [[6, 0]]
speed_mps = {}
)",
                                           thick_m, wide_m, tall_m, at_m, speed_mps)),
             {"speckle=false"});
  Simulator simulator(scene);
  const Sonar sonar = simulator.sonars()[0];
  const double end_m =
      std::hypot((at_m + 0.5 * thick_m) * height_m / (height_m - tall_m), height_m);
  for (const double t_s : {0.0, 5.0, 9.5, 12.0, 40.0}) {
    const double east_m = -3.0 + std::min(6.0, speed_mps * t_s);
    Pose pose = over_bed(13.0, height_m);
    pose.t_s = t_s;
    const auto lines = ping(simulator, pose);
    const auto is_shadow = [&](std::size_t beam, double range_m) {
      const std::size_t bin = static_cast<std::size_t>(range_m / sonar.bin_m());
      const bool dark = lines[beam].bins.region[bin] == static_cast<std::uint32_t>(Region::shadow);
      if (dark) CHECK(lines[beam].bins.shadow_instance[bin] == 1);
      return dark;
    };
    // Its edges are the lines through the corners that are outermost from the sonar.
    double left_rad = 2.0, right_rad = -2.0;
    for (const double side : {-0.5, 0.5})
      for (const double depth : {-0.5, 0.5}) {
        const double rad = std::atan2(east_m + side * wide_m, at_m + depth * thick_m);
        left_rad = std::min(left_rad, rad);
        right_rad = std::max(right_rad, rad);
      }
    for (std::size_t beam = 0; beam < lines.size(); ++beam) {
      const double bearing_rad = sonar.bearing_rad(static_cast<int>(beam));
      if (std::min(std::abs(bearing_rad - left_rad), std::abs(bearing_rad - right_rad)) <
          1.5 * degree)
        continue;  // partly
      CAPTURE(t_s, bearing_rad / degree);
      CHECK(is_shadow(beam, 12.0) == (bearing_rad > left_rad && bearing_rad < right_rad));
    }
    const double middle_rad = std::atan2(east_m, at_m);
    std::size_t middle = 0;
    while (sonar.bearing_rad(static_cast<int>(middle)) < middle_rad) ++middle;
    // Seen obliquely, the far face is farther away by the cosine.
    const double far_m = (end_m * end_m - height_m * height_m) / std::pow(std::cos(middle_rad), 2);
    CAPTURE(t_s);
    CHECK(is_shadow(middle, std::hypot(std::sqrt(far_m), height_m) - 0.15));
    CHECK(!is_shadow(middle, std::hypot(std::sqrt(far_m), height_m) + 0.25));
  }
}

TEST_CASE("a box casts its shadow over the beams that it covers, from its foot to X h / (h - t)") {
  constexpr double height_m = 3.0, tall_m = 1.5, wide_m = 4.0, at_m = 8.0, thick_m = 0.2;
  const Scene scene = parsed(level_scene(13.0, fmt::format(R"([[objects]]
shape = "box"
length_m = {}
width_m = {}
tall_m = {}
north_m = {}
)",
                                                           thick_m, wide_m, tall_m, at_m)),
                             {"speckle=false"});
  Simulator simulator(scene);
  const auto lines = ping(simulator, over_bed(13.0, height_m));
  const Sonar& sonar = simulator.sonars()[0];
  const double end_m =
      std::hypot((at_m + 0.5 * thick_m) * height_m / (height_m - tall_m), height_m);
  const auto is_shadow = [&](std::size_t beam, double range_m) {
    return lines[beam].bins.region[static_cast<std::size_t>(range_m / sonar.bin_m())] ==
           static_cast<std::uint32_t>(Region::shadow);
  };
  CHECK(is_shadow(128, end_m - 0.1));
  CHECK(!is_shadow(128, end_m + 0.2));
  CHECK(lines[128].bins.shadow_instance[static_cast<std::size_t>((end_m - 1.0) / sonar.bin_m())] ==
        1);
  // Seen from above, the shadow's edges are the lines through the box's near corners.
  const double edge_rad = std::atan2(0.5 * wide_m, at_m - 0.5 * thick_m);
  for (std::size_t beam = 0; beam < lines.size(); ++beam) {
    const double bearing_rad = sonar.bearing_rad(static_cast<int>(beam));
    if (std::abs(std::abs(bearing_rad) - edge_rad) < 1.5 * degree) continue;  // partly
    CAPTURE(bearing_rad / degree);
    CHECK(is_shadow(beam, 12.0) == (std::abs(bearing_rad) < edge_rad));
  }
}
