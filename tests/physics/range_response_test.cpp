#include <algorithm>
#include <cmath>

#include "support/beds.h"
#include "support/catch.h"

#include <ensonify/scatter/decibel.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

constexpr double plate_m = 15.0;

/// The echo of a plate of 1 mm in the middle of the fan at a range of 15 m.
EchoLine echo_of_point(const Pulse& pulse) {
  Seafloor plate = level_bed(0.6 * plate_m, 0.0005);
  for (Eigen::Vector3f& p : plate.mesh.positions) p.x() += static_cast<float>(0.8 * plate_m);
  Sonar sonar = plain_sonar();
  sonar.pulse = pulse;
  sonar.range_m = 20.0;
  sonar.bins = 20000;  // of 1 mm
  sonar.planes = 512;
  sonar.elevations = 4096;
  // Only towards the plate: a ray every 0.05 mm.
  const double depression_rad = std::asin(0.6);
  sonar.sector_low_rad = depression_rad - 0.005;
  sonar.sector_high_rad = depression_rad + 0.005;
  return ping_once(sonar, plate, {}, 0.6 * plate_m)[1];
}

/// Width of the main lobe at a level below its peak.
double lobe_width_m(const std::vector<float>& intensity, double bin_m, double below_db) {
  const auto peak = std::max_element(intensity.begin(), intensity.end());
  const double level = *peak * scatter::from_db(-below_db);
  const auto reach = [&](int step) {
    auto at = peak;
    while (*(at + step) > level) at += step;
    const double here = *at, next = *(at + step);
    return static_cast<double>(std::abs(at - peak)) + (here - level) / (here - next);
  };
  return (reach(1) + reach(-1)) * bin_m;
}

/// The highest level beyond the first null on the far side, relative to the peak.
double side_lobe_db(const std::vector<float>& intensity) {
  auto at = std::max_element(intensity.begin(), intensity.end());
  const double peak = *at;
  while (*(at + 1) < *at) ++at;
  return scatter::to_db(*std::max_element(at, intensity.end()) / peak);
}

}  // namespace

TEST_CASE("a point's echo has the width of its pulse in range, and the pulse's side lobes") {
  const double bin_m = 0.001;
  Pulse sweep{.kind = PulseKind::lfm, .bandwidth_hz = 30e3};
  const double cell_m = 0.5 * 1500.0 / sweep.bandwidth_hz;
  const EchoLine plain = echo_of_point(sweep);
  const auto peak =
      std::max_element(plain.bins.intensity_mean.begin(), plain.bins.intensity_mean.end()) -
      plain.bins.intensity_mean.begin();
  CHECK(std::abs((double(peak) + 0.5) * bin_m - plate_m) <= 1.5 * bin_m);
  CHECK(lobe_width_m(plain.bins.intensity_mean, bin_m, 3.0103) ==
        Approx(0.886 * cell_m).epsilon(0.01));
  CHECK(side_lobe_db(plain.bins.intensity_mean) == Approx(-13.26).margin(0.1));

  sweep.window = PulseWindow::hann;
  const EchoLine hann = echo_of_point(sweep);
  CHECK(lobe_width_m(hann.bins.intensity_mean, bin_m, 3.0103) ==
        Approx(1.44 * cell_m).epsilon(0.01));
  CHECK(side_lobe_db(hann.bins.intensity_mean) == Approx(-31.5).margin(0.3));

  const EchoLine cw = echo_of_point({.kind = PulseKind::cw, .bandwidth_hz = 30e3});
  CHECK(lobe_width_m(cw.bins.intensity_mean, bin_m, 3.0103) == Approx(cell_m).epsilon(0.01));
  // The echo begins at the point's range.
  const std::vector<float>& tone = cw.bins.intensity_mean;
  const float peak_of_tone = *std::max_element(tone.begin(), tone.end());
  for (std::size_t i = 0; i < tone.size(); ++i) {
    const double r = (double(i) + 0.5) * bin_m;
    CAPTURE(r);
    if (r < plate_m - 2.0 * bin_m || r > plate_m + cell_m + 2.0 * bin_m) REQUIRE(tone[i] == 0.0f);
    if (r > plate_m + 2.0 * bin_m && r < plate_m + cell_m - 2.0 * bin_m)
      REQUIRE(tone[i] == Approx(peak_of_tone).epsilon(0.01));
  }
}

TEST_CASE("a moving sonar hears an echo where it is when that comes back") {
  // An echo of a place p at the distance R, sent at 0 and received at t: R + |p - v t| = c t.
  constexpr double altitude_m = 10.0, c = 1500.0;
  const Eigen::Vector3d sonar_at(0.0, 0.0, -10.0);
  for (const Eigen::Vector3d& velocity_mps :
       {Eigen::Vector3d(5.0, 0.0, 0.0), Eigen::Vector3d(-3.0, 2.0, 0.0),
        Eigen::Vector3d(0, 0, -4)}) {
    const auto lines = ping_once(plain_sonar(), level_bed(20.0),
                                 {.position = sonar_at, .velocity_mps = velocity_mps}, altitude_m);
    std::size_t lit = 0;
    for (const EchoLine& line : lines)
      for (std::size_t i = 0; i < line.bins.range_m.size(); ++i) {
        if (line.bins.region[i] != std::uint32_t(Region::seabed) || line.bins.range_m[i] < 11.0)
          continue;
        ++lit;
        const Eigen::Vector3d place =
            Eigen::Vector3d(double(line.bins.x_m[i]), double(line.bins.y_m[i]), -20.0) - sonar_at;
        const double t_s = 2.0 * (c * place.norm() - place.dot(velocity_mps)) /
                           (c * c - velocity_mps.squaredNorm());
        CAPTURE(velocity_mps.transpose(), line.bins.range_m[i]);
        REQUIRE(line.bins.range_m[i] == Approx(0.5 * c * t_s).margin(0.01));
      }
    CHECK(lit > 2500);
  }
}

TEST_CASE(
    "over a flat bed a sonar that moves to the side hears a sweep nearer or farther by v f T / B") {
  constexpr double altitude_m = 10.0, speed_mps = 1.5;
  Sonar sonar = plain_sonar();
  sonar.pulse = {
      .kind = PulseKind::lfm, .bandwidth_hz = 20e3, .length_s = 10e-3, .window = PulseWindow::hann};
  const double shift_m = speed_mps * 400e3 * 10e-3 / 20e3;  // 0.3 m
  const Pose pose{.position = {0.0, 0.0, -10.0}, .velocity_mps = {speed_mps, 0.0, 0.0}};
  const auto lines = ping_once(sonar, level_bed(20.0), pose, altitude_m);
  for (const EchoLine& line : lines) {
    const double to_side = line.sector == 1 ? 1.0 : -1.0;
    std::size_t lit = 0;
    for (std::size_t i = 0; i < line.bins.range_m.size(); ++i) {
      if (line.bins.region[i] != std::uint32_t(Region::seabed) || line.bins.range_m[i] < 11.0)
        continue;
      ++lit;
      const double over_m = std::abs(double(line.bins.x_m[i])), r = std::hypot(over_m, altitude_m);
      CAPTURE(to_side, line.bins.range_m[i]);
      REQUIRE(line.bins.range_m[i] - r ==
              Approx(-to_side * (shift_m + r * speed_mps / 1500.0) * over_m / r)
                  .margin(0.2 * sonar.bin_m()));
    }
    CHECK(lit == std::size_t(sonar.bins) - std::size_t(11.0 / sonar.bin_m()));
    CHECK(line.starved == 0);
  }
  // Straight below nothing closes: the first return stays.
  CHECK(lines[1].bins.range_m[std::size_t(lines[1].first_return)] ==
        Approx(altitude_m).margin(sonar.bin_m()));
}

TEST_CASE("water absorbs a moving sonar's sweep over its path, not over its range") {
  // Out to a place p at the distance R, and back from there: R + |p - v t|.
  constexpr double c = 1500.0, altitude_m = 10.0, db_per_m = 0.3, speed_mps = 2.0;
  Sonar sonar = plain_sonar();
  sonar.frequency_hz = 900e3;
  sonar.pulse = {
      .kind = PulseKind::lfm, .bandwidth_hz = 40e3, .length_s = 5e-3, .window = PulseWindow::hann};
  const Pose pose{.position = {0.0, 0.0, -10.0}, .velocity_mps = {speed_mps, 0.0, 0.0}};
  const auto lines = [&](const Seafloor& bed, double absorption) {
    return ping_once(sonar, bed, pose, altitude_m, {c, absorption});
  };
  const auto absorbed_db = [&](const Eigen::Vector3d& place) {
    const double t_s = 2.0 * (c * place.norm() - place.dot(pose.velocity_mps)) /
                       (c * c - pose.velocity_mps.squaredNorm());
    return db_per_m * c * t_s;
  };
  const Seafloor bed = level_bed(20.0);
  const auto through = lines(bed, db_per_m), without = lines(bed, 0.0);
  for (const std::size_t side : {0u, 1u})
    for (const double r : {14.0, 30.0, 60.0}) {
      const auto bin = static_cast<std::size_t>(r / sonar.bin_m());
      const BinLayers& bins = through[side].bins;
      const Eigen::Vector3d place(double(bins.x_m[bin]), double(bins.y_m[bin]), -altitude_m);
      CAPTURE(side, r);
      CHECK(scatter::to_db(without[side].bins.intensity_mean[bin] / bins.intensity_mean[bin]) ==
            Approx(absorbed_db(place)).epsilon(0).margin(0.02));
    }
}

TEST_CASE("a sweep's shadow moves with its echoes") {
  constexpr double altitude_m = 10.0;
  Sonar sonar = plain_sonar();
  sonar.pulse = {
      .kind = PulseKind::lfm, .bandwidth_hz = 20e3, .length_s = 10e-3, .window = PulseWindow::hann};
  Seafloor bed = level_bed(20.0);
  add_box(bed, {25.0f, -20.0f, -20.0f}, {26.0f, 20.0f, -17.0f});
  const auto shadow = [&](double speed_mps) {
    const auto line = ping_once(
        sonar, bed, {.position = {0.0, 0.0, -10.0}, .velocity_mps = {speed_mps, 0.0, 0.0}},
        altitude_m)[1];
    std::size_t first = line.bins.region.size(), count = 0;
    for (std::size_t i = 0; i < line.bins.region.size(); ++i)
      if (line.bins.region[i] == std::uint32_t(Region::shadow)) {
        first = std::min(first, i);
        ++count;
      }
    return std::pair(double(first), double(count));
  };
  const auto still = shadow(0.0), closing = shadow(2.0);
  const double range_to_m = std::hypot(25.5, 8.5);
  CHECK((still.first - closing.first) * sonar.bin_m() ==
        Approx((0.4 + range_to_m * 2.0 / 1500.0) * 25.5 / range_to_m).margin(2.0 * sonar.bin_m()));
  CHECK(closing.second == Approx(still.second).margin(2.0));
  CHECK(still.second > 50.0);
}
