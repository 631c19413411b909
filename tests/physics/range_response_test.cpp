#include <algorithm>
#include <cmath>

#include "support/beds.h"
#include "support/catch.h"

#include <ensonify/scatter/decibel.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

constexpr double range_m = 15.0;

/// The echo of a plate of 1 mm in the middle of the fan at a range of 15 m.
EchoLine echo_of_point(const Pulse& pulse) {
  Seafloor plate = level_bed(0.6 * range_m, 0.0005);
  for (Eigen::Vector3f& p : plate.mesh.positions) p.x() += static_cast<float>(0.8 * range_m);
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
  return ping_once(sonar, plate, {}, 0.6 * range_m)[1];
}

/// Width of the main lobe at a level below its peak.
double width_m(const std::vector<float>& intensity, double bin_m, double below_db) {
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

/// The highest level beyond the first null on the far side, over the peak.
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
  CHECK(std::abs((double(peak) + 0.5) * bin_m - range_m) <= 1.5 * bin_m);
  CHECK(width_m(plain.bins.intensity_mean, bin_m, 3.0103) == Approx(0.886 * cell_m).epsilon(0.01));
  CHECK(side_lobe_db(plain.bins.intensity_mean) == Approx(-13.26).margin(0.1));

  sweep.window = PulseWindow::hann;
  const EchoLine hann = echo_of_point(sweep);
  CHECK(width_m(hann.bins.intensity_mean, bin_m, 3.0103) == Approx(1.44 * cell_m).epsilon(0.01));
  CHECK(side_lobe_db(hann.bins.intensity_mean) == Approx(-31.5).margin(0.3));

  const EchoLine cw = echo_of_point({.kind = PulseKind::cw, .bandwidth_hz = 30e3});
  CHECK(width_m(cw.bins.intensity_mean, bin_m, 3.0103) == Approx(cell_m).epsilon(0.01));
}
