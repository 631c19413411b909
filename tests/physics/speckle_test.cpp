#include <cmath>
#include <vector>

#include "support/beds.h"
#include "support/catch.h"

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

struct Moments {
  double mean = 0.0, deviation = 0.0;
};
Moments moments(const std::vector<double>& values) {
  double sum = 0.0, squares = 0.0;
  for (const double v : values) sum += v;
  const double mean = sum / static_cast<double>(values.size());
  for (const double v : values) squares += (v - mean) * (v - mean);
  return {mean, std::sqrt(squares / static_cast<double>(values.size()))};
}

/// Intensity over its expectation, of many pings of one even line.
std::vector<double> speckle_factors() {
  const Seafloor bed = level_bed(20.0);
  Sonar sonar = plain_sonar();
  const std::vector<scatter::BackscatterTable> lambert(
      2, scatter::BackscatterTable(scatter::Lambert()));
  Pinger pinger(sonar, 0, {}, bed, lambert);
  EchoLine line;
  line.bins.assign(static_cast<std::size_t>(sonar.bins));
  std::fill(line.bins.intensity_mean.begin(), line.bins.intensity_mean.end(), 4.0f);
  std::vector<double> factors;
  for (std::uint64_t ping = 0; ping < 200; ++ping)
    for (const Side side : {Side::port, Side::starboard}) {
      line.side = side;
      pinger.speckle(1, ping, line);
      for (const float i : line.bins.intensity) factors.push_back(i / 4.0);
    }
  return factors;
}

}  // namespace

TEST_CASE("speckle is fully developed: intensity of contrast 1, amplitude of Rayleigh's 0.5227") {
  std::vector<double> values = speckle_factors();  // 600,000
  const Moments intensity = moments(values);
  CHECK(intensity.mean == Approx(1.0).epsilon(0.005));  // it takes and adds no energy
  CHECK(intensity.deviation / intensity.mean == Approx(1.0).epsilon(0.01));
  for (double& v : values) v = std::sqrt(v);
  const Moments amplitude = moments(values);
  CHECK(amplitude.deviation / amplitude.mean == Approx(0.5227).epsilon(0.005));
  for (double& v : values) v = 20.0 * std::log10(v);
  const Moments level_db = moments(values);
  CHECK(level_db.deviation == Approx(5.57).epsilon(0.01));
  CHECK(level_db.mean == Approx(-2.51).epsilon(0.01));
}

TEST_CASE("speckle differs between pings and sides, and is the same when asked again") {
  const std::vector<double> once = speckle_factors(), again = speckle_factors();
  CHECK(once == again);
  const std::size_t bins = 1500;
  for (const std::size_t other : {bins, 2 * bins}) {
    double product = 0.0;
    for (std::size_t i = 0; i < bins; ++i) product += (once[i] - 1.0) * (once[other + i] - 1.0);
    CHECK(std::abs(product / bins) < 4.0 / std::sqrt(bins));
  }
}
