// The statistics of received echoes: fully developed speckle, its correlations, and the noise.

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include "physics/above_bed.h"
#include "support/catch.h"
#include "support/lines.h"

#include <ensonify/scatter/ambient_noise.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

using std::numbers::pi;

struct Spread {
  double mean = 0.0, deviation = 0.0;
};
Spread spread_of(const std::vector<double>& values) {
  double sum = 0.0, squares = 0.0;
  for (const double v : values) sum += v;
  const double mean = sum / static_cast<double>(values.size());
  for (const double v : values) squares += (v - mean) * (v - mean);
  return {mean, std::sqrt(squares / static_cast<double>(values.size()))};
}

/// A signal chain and its memory.
struct BedReceiver {
  explicit BedReceiver(const Sonar& its_sonar, const ChainOptions& options = {})
      : sonar(its_sonar), chain(its_sonar, options) {}

  std::vector<double> intensity(EchoLine& line, const Eigen::Vector3d& array,
                                std::uint64_t ping = 0) {
    receive_lines(chain, {.ping = ping, .array = {array, {0, 1, 0}}, .altitude_m = altitude_m},
                  std::span(&line, 1), scratch);
    const auto first = static_cast<std::ptrdiff_t>(std::max(line.first_return, 0));
    return {line.bins.intensity.begin() + first, line.bins.intensity.end()};
  }
  /// The intensities from the first return on, over a level bed at a depth of 20 m.
  std::vector<double> intensity(double north_m, const Sector& sector = starboard_sector,
                                std::uint64_t ping = 0) {
    const Eigen::Vector3d array{0.0, north_m, -10.0};
    EchoLine line = level_line(sonar, sector, array, altitude_m);
    return intensity(line, array, ping);
  }

  Sonar sonar;
  SignalChain chain;
  SignalChain::Scratch scratch;
};

/// The intensities of a ping over a level bed, to starboard of a heading; the array has that
/// heading or another.
std::vector<double> headed_intensity(BedReceiver& receiver, const Eigen::Vector3d& array,
                                     double heading_rad, std::optional<double> array_rad = {}) {
  EchoLine line = level_line(receiver.sonar, starboard_sector, array, altitude_m);
  const Eigen::Vector2d abeam(std::cos(heading_rad), -std::sin(heading_rad));
  for (std::size_t i = 0; i < line.bins.x_m.size(); ++i)
    if (line.bins.intensity_mean[i] > 0.0f) {
      const double over_m = line.bins.x_m[i] - array.x();
      line.bins.x_m[i] = static_cast<float>(array.x() + over_m * abeam.x());
      line.bins.y_m[i] = static_cast<float>(array.y() + over_m * abeam.y());
    }
  const double axis_rad = array_rad.value_or(heading_rad);
  receive_lines(
      receiver.chain,
      {.array = {array, {std::sin(axis_rad), std::cos(axis_rad), 0}}, .altitude_m = altitude_m},
      std::span(&line, 1), receiver.scratch);
  return {line.bins.intensity.begin(), line.bins.intensity.end()};
}

/// The intensities of many uncorrelated pings.
std::vector<double> independent_intensities(const Sonar& sonar, int pings = 150) {
  BedReceiver receiver(sonar);
  std::vector<double> all;
  for (int ping = 0; ping < pings; ++ping)
    for (const Sector& sector : sidescan_sectors) {
      const std::vector<double> one = receiver.intensity(10.0 * ping, sector);
      all.insert(all.end(), one.begin(), one.end());
    }
  return all;
}

double quantile(const std::vector<double>& sorted, double share) {
  return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size()))];
}

}  // namespace

TEST_CASE("speckle is fully developed: exponential intensity, Rayleigh amplitude") {
  std::vector<double> values = independent_intensities(quiet_sonar());  // 390,000
  const Spread intensity = spread_of(values);
  CHECK(intensity.mean == Approx(1.0).epsilon(0.01));  // it does not change the mean energy
  CHECK(intensity.deviation / intensity.mean == Approx(1.0).epsilon(0.015));
  std::vector<double> sorted = values;
  std::ranges::sort(sorted);
  for (const double share : {0.01, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99, 0.999})
    CHECK(quantile(sorted, share) == Approx(-std::log(1.0 - share)).epsilon(0.05));
  double third = 0.0;  // moment n of an exponential distribution is n!
  for (const double v : values) third += v * v * v;
  CHECK(third / static_cast<double>(values.size()) == Approx(6.0).epsilon(0.06));

  for (double& v : values) v = std::sqrt(v);
  const Spread amplitude = spread_of(values);
  CHECK(amplitude.deviation / amplitude.mean == Approx(0.5227).epsilon(0.01));
  CHECK(amplitude.mean / std::sqrt(intensity.mean) == Approx(0.8862).epsilon(0.005));
  for (double& v : values) v = 20.0 * std::log10(v);
  const Spread level_db = spread_of(values);
  CHECK(level_db.deviation == Approx(5.57).epsilon(0.015));
  CHECK(level_db.mean == Approx(-2.51).epsilon(0.02));
}

TEST_CASE("M looks have the intensity's contrast of M^-1/2, and the gamma's moments") {
  for (const int looks : {2, 4}) {
    Sonar sonar = quiet_sonar();
    sonar.receiver.looks = looks;
    const std::vector<double> values = independent_intensities(sonar, 60);
    const Spread intensity = spread_of(values);
    CAPTURE(looks);
    CHECK(intensity.mean == Approx(1.0).epsilon(0.015));
    CHECK(intensity.deviation == Approx(1.0 / std::sqrt(looks)).epsilon(0.02));
    double third = 0.0;
    for (const double v : values) third += v * v * v;
    CHECK(third / static_cast<double>(values.size()) ==
          Approx((1.0 + 1.0 / looks) * (1.0 + 2.0 / looks)).epsilon(0.06));
  }
}

TEST_CASE("a patchy bed, its strength a gamma distribution's, gives K-distributed amplitudes") {
  constexpr double nu = 2.0;
  BedReceiver receiver(quiet_sonar());
  std::mt19937_64 random(1);
  std::gamma_distribution<double> patch(nu, 1.0 / nu);
  std::vector<double> values;
  for (int ping = 0; ping < 250; ++ping) {
    const Eigen::Vector3d array{0.0, 10.0 * ping, -10.0};
    EchoLine line = level_line(receiver.sonar, starboard_sector, array, altitude_m);
    double strength = 1.0;
    for (std::size_t i = 0; i < line.bins.intensity_mean.size(); ++i) {
      if (i % 10 == 0) strength = patch(random);  // half a metre
      line.bins.intensity_mean[i] *= static_cast<float>(strength);
    }
    const std::vector<double> one = receiver.intensity(line, array);
    values.insert(values.end(), one.begin(), one.end());
  }
  const Spread intensity = spread_of(values);
  CHECK(intensity.mean == Approx(1.0).epsilon(0.03));
  const double contrast2 = std::pow(intensity.deviation / intensity.mean, 2);
  CHECK(contrast2 == Approx(1.0 + 2.0 / nu).epsilon(0.06));
  double amplitude = 0.0;
  for (const double v : values) amplitude += std::sqrt(v);
  amplitude /= static_cast<double>(values.size());
  CHECK(amplitude / std::sqrt(intensity.mean) ==
        Approx(std::tgamma(nu + 0.5) * std::tgamma(1.5) / (std::tgamma(nu) * std::sqrt(nu)))
            .epsilon(0.01));
}

TEST_CASE("neighbouring bins have the pulse's autocorrelation, in speckle and in noise") {
  struct Case {
    PulseKind kind;
    PulseWindow window;
    double bandwidth_hz;
  };
  for (const Case& one :
       {Case{PulseKind::cw, PulseWindow::none, 15e3}, Case{PulseKind::cw, PulseWindow::none, 6e3},
        Case{PulseKind::cw, PulseWindow::none, 60e3}, Case{PulseKind::lfm, PulseWindow::none, 9e3},
        Case{PulseKind::lfm, PulseWindow::none, 40e3},
        Case{PulseKind::lfm, PulseWindow::hann, 9e3}}) {
    Sonar sonar = quiet_sonar();  // bins of 5 cm, 15 kHz
    sonar.pulse.kind = one.kind;
    sonar.pulse.window = one.window;
    sonar.pulse.bandwidth_hz = one.bandwidth_hz;
    for (const bool noise : {false, true}) {
      sonar.receiver.noise = noise;
      BedReceiver receiver(sonar);
      std::array<double, 5> sums{};
      constexpr int pings = 100;
      for (int ping = 0; ping < pings; ++ping) {
        std::vector<double> line;
        if (noise) {
          EchoLine empty;
          empty.bins.assign(static_cast<std::size_t>(sonar.bins));
          line = receiver.intensity(empty, {0, 0, -10}, static_cast<std::uint64_t>(ping));
        } else {
          line = receiver.intensity(10.0 * ping);
        }
        for (std::size_t lag = 1; lag < sums.size(); ++lag)
          sums[lag] += correlation({line.begin(), line.end() - static_cast<std::ptrdiff_t>(lag)},
                                   {line.begin() + static_cast<std::ptrdiff_t>(lag), line.end()});
      }
      for (std::size_t lag = 1; lag < sums.size(); ++lag) {
        // The autocorrelation of the pulse, in closed form: a triangle for a box, a sinc
        // for a sweep or, with a Hann window, the cosine transform of cos^4.
        const double x = static_cast<double>(lag) * 0.1 / 1500.0 * one.bandwidth_hz;
        double expected = std::max(0.0, 1.0 - x);
        if (one.kind == PulseKind::lfm) {
          double over = 0.0, under = 0.0;
          for (int i = 0; i < 2000; ++i) {
            const double f = (i + 0.5) / 2000 - 0.5;
            const double power =
                one.window == PulseWindow::hann ? std::pow(std::cos(pi * f), 4) : 1.0;
            over += power * std::cos(2.0 * pi * f * x);
            under += power;
          }
          expected = over / under;
        }
        CAPTURE(static_cast<int>(one.kind), one.bandwidth_hz, lag, noise);
        CHECK(sums[lag] / pings == Approx(expected * expected).margin(0.02));
      }
    }
  }
}

namespace {

/// The two-way field of an array of point elements at a distance y from its middle, with exact
/// distances.
std::complex<double> two_way(const Sonar& sonar, double y_m, double range_m) {
  const double k = 2.0 * pi * sonar.frequency_hz / 1500.0;
  std::complex<double> sum = 0.0;
  constexpr int elements = 200;
  for (int i = 0; i < elements; ++i) {
    const double u = (i + 0.5) / elements - 0.5, a = u * sonar.array_length_m;
    const double weight = sonar.shading == ShadingKind::hann ? 1.0 + std::cos(2.0 * pi * u) : 1.0;
    const double exact = std::hypot(range_m, y_m - a) - range_m;
    const double focus_m = sonar.focused                 ? range_m
                           : sonar.focus_zones_m.empty() ? 1e9
                                                         : sonar.focus_zones_m.front();
    const double delay = std::hypot(focus_m, a) - focus_m;
    sum += std::polar(weight / elements, k * (exact - delay));
  }
  return sum * sum;
}

double along_track_correlation(const Sonar& sonar, double step_m, double range_m) {
  std::complex<double> both = 0.0;
  double one = 0.0;
  for (double y = -1.5; y < 1.5; y += 0.004) {
    const std::complex<double> here = two_way(sonar, y, range_m);
    both += here * std::conj(two_way(sonar, y - step_m, range_m));
    one += std::norm(here);
  }
  return std::norm(both) / (one * one);  // the intensities' correlation is |.|^2 of the amplitudes'
}

}  // namespace

TEST_CASE("overlapping pings have the correlation of their beams along the track") {
  struct Array {
    bool focused;
    std::vector<double> zones_m;
    ShadingKind shading;
  };
  for (const Array& array :
       {Array{true, {}, ShadingKind::uniform}, Array{false, {}, ShadingKind::uniform},
        Array{true, {}, ShadingKind::hann}, Array{false, {25.0}, ShadingKind::hann}})
    for (const double range_m : {14.0, 40.0, 68.0}) {
      Sonar sonar = quiet_sonar();
      sonar.focused = array.focused;
      sonar.focus_zones_m = array.zones_m;
      sonar.shading = array.shading;
      BedReceiver receiver(sonar);
      const auto middle = static_cast<std::size_t>(range_m / sonar.bin_m());
      for (const double step_m : {0.05, 0.1, 0.2, 0.3, 0.5}) {
        double sum = 0.0;
        constexpr int pairs = 60;
        for (int pair = 0; pair < pairs; ++pair) {
          const auto near = [&](double north_m) {
            const std::vector<double> all = receiver.intensity(north_m);
            const std::size_t first = middle - all.size() % 1 - 200 - 50;
            const auto from = all.begin() + static_cast<std::ptrdiff_t>(first);
            return std::vector<double>(from, from + 100);
          };
          sum += correlation(near(7.3 * pair), near(7.3 * pair + step_m));
        }
        CAPTURE(array.focused, array.zones_m.size(), static_cast<int>(array.shading), range_m,
                step_m);
        // Up to 16 cells across a beam let a few percent remain where theory has 0.
        CHECK(sum / pairs == Approx(along_track_correlation(sonar, step_m, range_m))
                                 .margin(array.shading == ShadingKind::uniform ? 0.045 : 0.06));
      }
    }
}

TEST_CASE("on any heading, pings along the array correlate, and bins drift as it moves sideways") {
  BedReceiver receiver(quiet_sonar());
  const Sonar& sonar = receiver.sonar;
  constexpr double range_m = 40.0;
  const double cos_grazing = std::sqrt(1.0 - std::pow(altitude_m / range_m, 2));
  const auto middle = static_cast<std::size_t>(range_m / sonar.bin_m());
  for (const double heading_deg : {0.0, 1e-9, -1e-9, 3.0, 7.0, 11.0, 20.0, -52.0}) {
    const double heading = heading_deg * pi / 180.0;
    const Eigen::Vector3d along(std::sin(heading), std::cos(heading), 0.0),
        starboard(std::cos(heading), -std::sin(heading), 0.0);
    // The array's way from one ping to the next: along its axis, and to port by this number of
    // bins in range.
    for (const int bins : {-1, 0, 1, 3}) {
      constexpr double step_m = 0.15;
      const Eigen::Vector3d way = step_m * along - bins * sonar.bin_m() / cos_grazing * starboard;
      double sum = 0.0;
      constexpr int pairs = 60;
      for (int pair = 0; pair < pairs; ++pair) {
        const Eigen::Vector3d array(0.0, 7.3 * pair, -10.0);
        const auto part = [&](const std::vector<double>& all, int shift) {
          const auto from = all.begin() + static_cast<std::ptrdiff_t>(middle) - 25 + shift;
          return std::vector<double>(from, from + 50);
        };
        sum += correlation(part(headed_intensity(receiver, array, heading), 0),
                           part(headed_intensity(receiver, array + way, heading), bins));
      }
      CAPTURE(heading_deg, bins);
      CHECK(sum / pairs == Approx(along_track_correlation(sonar, step_m, range_m)).margin(0.06));
    }
  }
}

TEST_CASE(
    "a second pass on the same track has the same speckle, on another track it is uncorrelated") {
  BedReceiver receiver(quiet_sonar());
  const std::vector<double> first = receiver.intensity(3.0, starboard_sector, 1);
  CHECK(receiver.intensity(3.0, starboard_sector, 1000) ==
        first);  // it belongs to the ground, not to the ping
  CHECK(std::abs(correlation(first, receiver.intensity(4.5, starboard_sector, 2))) < 0.1);

  // The same places from the other side, and with an array whose heading differs by 30 degrees.
  const Eigen::Vector3d array{0.0, 3.0, -10.0};
  EchoLine line = level_line(receiver.sonar, starboard_sector, array, altitude_m);
  const Eigen::Vector3d opposite{2.0 * 40.0, 3.0, -10.0};
  CHECK(std::abs(correlation(first, receiver.intensity(line, opposite))) < 0.1);
  receive_lines(receiver.chain,
                {.array = {array, {0.5, std::sqrt(0.75), 0}}, .altitude_m = altitude_m},
                std::span(&line, 1), receiver.scratch);
  const std::vector<double> turned(line.bins.intensity.begin() + line.first_return,
                                   line.bins.intensity.end());
  CHECK(std::abs(correlation(first, turned)) < 0.1);
}

TEST_CASE("runs on the same and on the opposite heading see the same scatterers") {
  const Eigen::Vector3d array{0.0, 3.0, -10.0};
  for (const double heading_deg : {0.0, 7.5, 20.0, 52.5, 90.0, -135.0}) {
    const double heading = heading_deg * pi / 180.0;
    BedReceiver out(quiet_sonar(), {.heading_rad = heading}),
        near(quiet_sonar(), {.heading_rad = heading + 0.003}),
        back(quiet_sonar(), {.heading_rad = heading + pi});
    const std::vector<double> first = headed_intensity(out, array, heading);
    CAPTURE(heading_deg);
    CHECK(correlation(first, headed_intensity(near, array, heading)) > 0.99);
    CHECK(correlation(first, headed_intensity(back, array, heading, heading + pi)) > 0.99);
  }
}

TEST_CASE("a small yaw about the usual heading does not change the scatterers") {
  for (const double heading_deg : {0.0, 7.5, 11.25, 22.5, 97.5}) {
    const double heading = heading_deg * pi / 180.0;
    BedReceiver receiver(quiet_sonar(), {.heading_rad = heading});
    const Eigen::Vector3d array{0.0, 3.0, -10.0};
    CAPTURE(heading_deg);
    CHECK(correlation(headed_intensity(receiver, array, heading - 0.0004),
                      headed_intensity(receiver, array, heading + 0.0004)) > 0.5);
  }
}

TEST_CASE("a second pass at another altitude loses coherence as the grazing angle changes") {
  // For bins of length b on the ground the correlation of the intensities is |sinc(2 b (cos g' -
  // cos g) / lambda)|^2 (Li and Goldstein, IEEE Trans. GRS 28, 88, 1990, for a box).
  BedReceiver receiver(quiet_sonar());
  const double lambda_m = 1500.0 / receiver.sonar.frequency_hz;
  for (const double higher_m : {0.2, 0.5, 1.0, 1.6}) {
    double sum = 0.0, expected = 0.0;
    constexpr int pairs = 80;
    for (int pair = 0; pair < pairs; ++pair) {
      const Eigen::Vector3d array{0.0, 7.3 * pair, -10.0};
      const Eigen::Vector3d above = array + higher_m * Eigen::Vector3d::UnitZ();
      EchoLine line = level_line(receiver.sonar, starboard_sector, array, altitude_m);
      std::vector<double> first = receiver.intensity(line, array);
      for (std::size_t i = 0; i < line.bins.range_m.size(); ++i)
        if (line.bins.intensity_mean[i] > 0.0f)
          line.bins.range_m[i] =
              static_cast<float>(std::hypot(line.bins.x_m[i], altitude_m + higher_m));
      std::vector<double> second = receiver.intensity(line, above);
      first = {first.begin() + 350, first.begin() + 450};  // about 30 m
      second = {second.begin() + 350, second.begin() + 450};
      sum += correlation(first, second);
    }
    const double over_m = std::sqrt(30.0 * 30.0 - 100.0);
    const double change = over_m / 30.0 - over_m / std::hypot(over_m, altitude_m + higher_m);
    const double x = 2.0 * receiver.sonar.bin_m() * change / lambda_m;
    expected = std::pow(std::sin(pi * x) / (pi * x), 2);
    CAPTURE(higher_m, x);
    CHECK(sum / pairs == Approx(expected).margin(0.05));
  }
}

TEST_CASE("the noise has the level of the formulas, the array's gain and the band, flat in range") {
  for (const double frequency_hz : {30e3, 400e3, 900e3}) {
    Sonar sonar;
    sonar.frequency_hz = frequency_hz;
    sonar.vertical.beamwidth_rad = 0.0;  // the same in all directions
    ChainOptions options;
    options.sea.wind_mps = 7.0;
    BedReceiver receiver(sonar, options);
    // Directivity of a line array, 2 L / lambda (physics: 10 lg).
    const double gain_db = scatter::to_db(2.0 * sonar.array_length_m * frequency_hz / 1500.0);
    const double expected_db = scatter::ambient_noise_db(frequency_hz, 7.0, 0.5) +
                               scatter::to_db(sonar.pulse.bandwidth_hz) - gain_db;
    EchoLine line;
    line.bins.assign(static_cast<std::size_t>(sonar.bins));
    double near = 0.0, far = 0.0;
    const auto bins = static_cast<std::size_t>(sonar.bins);
    constexpr int pings = 200;
    for (std::uint64_t ping = 0; ping < pings; ++ping) {
      receiver.intensity(line, {0, 0, -10}, ping);
      for (std::size_t i = 0; i < bins; ++i) (i < bins / 2 ? near : far) += line.bins.intensity[i];
    }
    CAPTURE(frequency_hz);
    CHECK(scatter::to_db((near + far) / (pings * double(bins))) ==
          Approx(expected_db).margin(0.05));
    CHECK(near / far == Approx(1.0).epsilon(0.015));
  }
  // A shaded receiver receives more noise, by its noise width. A shaded transmitter has no effect.
  Sonar sonar;
  const double uniform = BedReceiver(sonar).chain.noise(0);
  sonar.receive_shading = ShadingKind::hann;
  CHECK(BedReceiver(sonar).chain.noise(0) == Approx(1.5 * uniform));
  sonar.receive_shading = ShadingKind::uniform;
  sonar.shading = ShadingKind::hann;
  CHECK(BedReceiver(sonar).chain.noise(0) == Approx(uniform));
  // Thermal noise alone: -15 + 20 lg 400 dB in 1 Hz.
  CHECK(scatter::thermal_noise_db(400e3) == Approx(37.04).margin(0.01));
}

TEST_CASE(
    "self-noise grows by 60 dB per factor of ten in speed above 2 m/s, at each ping's speed") {
  Sonar sonar;
  sonar.receiver.self_noise_db = 30.0;
  const SignalChain chain(sonar, {.speckle = false});
  SignalChain::Scratch scratch;
  EchoLine line;
  line.bins.assign(static_cast<std::size_t>(sonar.bins));
  const auto self_noise_db = [&](double speed_mps) {
    receive_lines(chain, {.speed_mps = speed_mps}, std::span(&line, 1), scratch);
    sonar.receiver.self_noise_db.reset();
    const double sea = SignalChain(sonar, {.speckle = false}).noise(0);
    sonar.receiver.self_noise_db = 30.0;
    return scatter::to_db((double(line.bins.intensity[50]) - sea) / sonar.pulse.bandwidth_hz);
  };
  CHECK(self_noise_db(0.0) == Approx(30.0).margin(1e-3));
  CHECK(self_noise_db(2.0) == Approx(30.0).margin(1e-3));
  CHECK(self_noise_db(3.0) == Approx(30.0 + 60.0 * std::log10(1.5)).margin(1e-3));
  CHECK(self_noise_db(20.0) == Approx(90.0).margin(1e-3));
  CHECK(chain.noise(0, 2.0) == chain.noise(0));

  sonar.receiver.self_noise_speed_mps = 1.0;
  sonar.receiver.self_noise_slope_db = 40.0;
  CHECK(scatter::to_db(sonar.receiver.self_noise_density(10.0)) == Approx(70.0));
}

TEST_CASE("the receiver's own noise adds to the sea's, and speckle = false gives their mean") {
  Sonar sonar;
  BedReceiver sea(sonar);
  sonar.receiver.self_noise_db = 20.0;
  BedReceiver own(sonar);
  const double added = own.chain.noise(0) - sea.chain.noise(0);
  CHECK(added == Approx(100.0 * sonar.pulse.bandwidth_hz));

  BedReceiver mean_only(sonar, {.speckle = false});
  EchoLine line = level_line(sonar, port_sector, {0, 0, -10}, altitude_m);
  for (float& mean : line.bins.intensity_mean) mean *= 1e7f;
  mean_only.intensity(line, {0, 0, -10});
  for (std::size_t i = 0; i < line.bins.intensity.size(); ++i)
    REQUIRE(line.bins.intensity[i] ==
            Approx(line.bins.intensity_mean[i] + mean_only.chain.noise(0)).epsilon(1e-4));
}
