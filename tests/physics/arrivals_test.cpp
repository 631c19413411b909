// Times and levels of the sound that is received in addition to the direct echo.

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "support/catch.h"
#include "support/lines.h"

#include <ensonify/engine/units.h>
#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/forward_lobe.h>
#include <ensonify/scatter/kirchhoff.h>
#include <ensonify/scatter/reflection.h>
#include <ensonify/scatter/surface_scatter.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

constexpr double altitude_m = 10.0, depth_m = 14.0;
const Eigen::Vector3d array{0.0, 0.0, -depth_m};
const PingContext context{.ping = 3, .array = {array, {0, 1, 0}}, .altitude_m = altitude_m};

Sonar open_sonar() {  // has the same gain in all vertical directions
  Sonar sonar = quiet_sonar();
  sonar.focused = true;
  sonar.vertical.beamwidth_rad = 0.0;
  return sonar;
}

/// The mean intensity of a ping with these other paths, over a bed with the direct echo `direct`.
struct Circumstances {
  Side side = Side::starboard;
  ArrayFrame array_frame = context.array;
  Pose motion = {};  // its rates
  ArtefactOptions artefacts = {};
  std::optional<scatter::Sediment> bed = {};
  std::function<double(double sine)> strength = [](double) { return 3e-4; };
  double ping_interval_s = 0.0;
};
std::vector<double> received(const Sonar& sonar, const OtherPathsOptions& arrivals,
                             const std::vector<float>& direct = {}, const SeaState& sea = {},
                             const Circumstances& under = {}) {
  const SignalChain chain(sonar, {.speckle = false,
                                  .absorption_db_per_m = 0.03,
                                  .ping_interval_s = under.ping_interval_s,
                                  .nominal_strength = under.strength,
                                  .bed = under.bed,
                                  .sea = sea,
                                  .arrivals = arrivals,
                                  .artefacts = under.artefacts});
  EchoLine line = level_line(sonar, under.side, array, altitude_m);
  std::fill(line.bins.intensity_mean.begin(), line.bins.intensity_mean.end(), 0.0f);
  std::copy(direct.begin(), direct.end(), line.bins.intensity_mean.begin());
  SignalChain::Memory memory;
  PingContext now = context;
  now.array = under.array_frame;
  for (const Side side : {Side::port, Side::starboard})
    now.motion[static_cast<std::size_t>(side)] =
        receiver_motion(under.motion, side, sonar.range_m, 1500.0);
  chain.receive(now, std::span(&line, 1), memory);
  return {line.bins.intensity.begin(), line.bins.intensity.end()};
}

}  // namespace

TEST_CASE("the surface's return comes from the sonar's depth, and its level from the formulas") {
  const Sonar sonar = open_sonar();
  const SeaState calm{.wind_mps = 0.0};
  std::vector<double> surface = received(sonar, {.surface = true}, {}, calm);
  const auto first = std::ranges::find_if(surface, [](double i) { return i > 0.0; });
  CHECK(double(first - surface.begin()) == Approx(depth_m / sonar.bin_m()).margin(1.0));

  // Far away both halves of the surface contribute; a line array's area is r phi c tau / 2 /
  // cos(grazing).
  const SeaState windy{.wind_mps = 8.0};
  surface = received(sonar, {.surface = true}, {}, windy);
  for (const double r : {30.0, 50.0, 70.0}) {
    const double sine = depth_m / r;
    const double width = 2.0 / 3.0 * 1500.0 / sonar.frequency_hz / sonar.array_length_m;
    const double area_m2 = r * width * sonar.pulse.cell_m(1500.0) / std::sqrt(1.0 - sine * sine);
    const double strength = scatter::surface_cross_section(
        {.wind_mps = 8.0, .frequency_hz = sonar.frequency_hz}, std::asin(sine));
    const double expected_db = sonar.source_level_db - 40.0 * std::log10(r) - 2.0 * 0.03 * r +
                               scatter::to_db(2.0 * area_m2 * strength);
    CAPTURE(r);
    CHECK(scatter::to_db(surface[static_cast<std::size_t>(r / sonar.bin_m())]) ==
          Approx(expected_db).margin(0.5));  // waves lift the surface by some decimetres
  }
}

TEST_CASE("the range of the surface's return varies with the waves, within their height") {
  Sonar sonar = open_sonar();
  sonar.bins = 7500;
  const SeaState sea{.wind_mps = 8.0};  // rms 0.25 * 0.21 * 64 / 9.81 = 0.34 m
  const SignalChain chain(sonar, {.speckle = false, .sea = sea, .arrivals = {.surface = true}});
  SignalChain::Memory memory;
  EchoLine line;
  line.bins.assign(7500);
  double sum = 0.0, squares = 0.0;
  constexpr int pings = 2000;
  for (int ping = 0; ping < pings; ++ping) {
    PingContext now = context;
    now.t_s = 0.37 * ping;
    chain.receive(now, std::span(&line, 1), memory);
    const auto first = std::ranges::find_if(line.bins.intensity, [](float i) { return i > 0.0f; });
    const double r = double(first - line.bins.intensity.begin()) * sonar.bin_m();
    sum += r;
    squares += r * r;
  }
  CHECK(sum / pings == Approx(depth_m).margin(0.05));
  CHECK(std::sqrt(squares / pings - std::pow(sum / pings, 2)) == Approx(0.342).epsilon(0.15));
}

TEST_CASE("volume reverberation has the level of the sonar equation for the water at each range") {
  const Sonar sonar = open_sonar();
  const std::vector<double> volume = received(sonar, {.volume = true});
  for (const double r : {2.0, 9.5, 12.0, 20.0, 40.0, 74.0}) {
    const auto bin = static_cast<std::size_t>(r / sonar.bin_m());
    const double at = (static_cast<double>(bin) + 0.5) * sonar.bin_m();
    // The width of sinc^4 is two thirds of lambda / L, over all depressions between surface and
    // bed.
    const double angle = 2.0 / 3.0 * 1500.0 / sonar.frequency_hz / sonar.array_length_m;
    const double around =
        2.0 * (std::asin(std::min(depth_m / at, 1.0)) + std::asin(std::min(altitude_m / at, 1.0)));
    // Urick, Principles of Underwater Sound (1983), chapter 8: SL - 2 TL - 2 alpha r + S_v + 10 lg
    // V, with the volume V of the angle times r^2 times c tau / 2.
    const double volume_m3 =
        angle * around * at * at * 0.5 * 1500.0 * sonar.pulse.effective_length_s();
    const double level_db = sonar.source_level_db - 40.0 * std::log10(at) - 2.0 * 0.03 * at - 80.0 +
                            scatter::to_db(volume_m3);
    CAPTURE(r);
    CHECK(scatter::to_db(volume[bin]) == Approx(level_db).margin(0.1));
  }
}

TEST_CASE("a sonar that rolls receives the same as one whose sides are mounted lower and higher") {
  const double roll_rad = 0.3;  // starboard down
  Sonar upright = quiet_sonar(), mounted = upright;
  mounted.vertical.starboard_mount_rad = roll_rad;
  mounted.vertical.port_mount_rad = -roll_rad;
  const ArrayFrame level{array, {0, 1, 0}};
  const ArrayFrame rolled{array, {0, 1, 0}, {-std::sin(roll_rad), 0.0, -std::cos(roll_rad)}};
  std::vector<float> direct(upright.bins, 0.0f);
  std::fill(direct.begin() + 250, direct.end(), 1.0f);
  const ArtefactOptions wake{.wake_db = 0.0, .wake_heading_rad = 0.0, .wake_offset_m = 12.0};
  const ArtefactOptions fish{.fish_per_hectare = 3000.0};
  struct Case {
    const char* name;
    OtherPathsOptions arrivals;
    ArtefactOptions artefacts = {};
  };
  for (const Case& what :
       {Case{"surface", {.surface = true}}, Case{"volume", {.volume = true}},
        Case{"multiples", {.multiples = true}}, Case{"wake", {}, wake}, Case{"fish", {}, fish}})
    for (const Side side : {Side::port, Side::starboard}) {
      const auto receive = [&](const Sonar& sonar, const ArrayFrame& array_frame) {
        const bool bed = what.arrivals.multiples;
        return received(sonar, what.arrivals, bed ? direct : std::vector<float>{}, {},
                        {.side = side, .array_frame = array_frame, .artefacts = what.artefacts});
      };
      const std::vector<double> by_roll = receive(upright, rolled),
                                by_mount = receive(mounted, level);
      CAPTURE(what.name, static_cast<int>(side));
      double changed = 0.0;
      const std::vector<double> unrolled = receive(upright, level);
      for (std::size_t n = 0; n < by_roll.size(); ++n) {
        REQUIRE(by_roll[n] == Approx(by_mount[n]).epsilon(2e-3).margin(1e-30));
        if (unrolled[n] > 0.0)
          changed = std::max(changed, std::abs(by_roll[n] - unrolled[n]) / unrolled[n]);
      }
      const bool nothing_there = what.artefacts.wake_db && side == Side::port;
      CHECK((nothing_there || changed > 0.02));
    }
}

TEST_CASE("surface, water and earlier pings are heard where a moving receiver looks by then") {
  // The beam in each direction, sent from the pose at transmission and heard at the pose when the
  // echo is back, is summed over the place of each bin. The array heads north.
  Sonar sonar = quiet_sonar();
  sonar.focused = true;
  const double wavelength_m = 1500.0 / sonar.frequency_hz, interval_s = 0.1;
  const LineArray line{sonar.array_length_m, wavelength_m};
  const auto power = [&](const Pose& pose, Side side, const Eigen::Vector3d& to) {
    const Eigen::Vector3d in_body = body_to_world(pose).transpose() * to.normalized();
    const double abeam = (side == Side::port ? -1.0 : 1.0) * in_body.y();
    return line.power(in_body.x()) * sonar.vertical.power(std::atan2(in_body.z(), abeam), side);
  };
  // Of the line along the track through a place in the plane abeam.
  const auto along = [&](const Pose& pose, Side side, double level_m, double up_m, double sent_s) {
    const double range_m = std::hypot(level_m, up_m), null_m = range_m * line.null_rad(1);
    const double back_s = 2.0 * range_m / 1500.0;
    double sum = 0.0;
    for (double y = -3.995; y < 4.0; y += 0.01) {
      const Eigen::Vector3d place{level_m, y * null_m, up_m};
      const double sine = body_to_world(pose.after(sent_s)).col(0).dot(place) / range_m;
      if (std::abs(sine) > std::sin(line.null_rad(1))) continue;  // no rays go there
      sum += power(pose.after(sent_s), side, place) *
             power(pose.after(sent_s + back_s), side, place - back_s * pose.velocity_mps);
    }
    return sum;
  };
  struct Path {
    const char* name;
    OtherPathsOptions arrivals;
    std::function<double(const Pose&, Side, double range_m)> sum;
  };
  const Path paths[] = {
      {"surface",
       {.surface = true},
       [&](const Pose& pose, Side side, double r) {
         const double level_m = std::sqrt(r * r - depth_m * depth_m);
         return along(pose, side, level_m, depth_m, 0.0) +
                along(pose, side, -level_m, depth_m, 0.0);
       }},
      {"water",
       {.volume = true},
       [&](const Pose& pose, Side side, double r) {
         double sum = 0.0;
         for (int i = 0; i < 360; ++i) {
           const double turn_rad = (i + 0.5) * degree;
           const double level_m = r * std::cos(turn_rad), up_m = r * std::sin(turn_rad);
           if (up_m < depth_m && up_m > -altitude_m) sum += along(pose, side, level_m, up_m, 0.0);
         }
         return sum;
       }},
      {"earlier ping", {.second_time_around = true}, [&](const Pose& pose, Side side, double r) {
         double sum = 0.0;
         for (int pings = 1; pings <= 8; ++pings) {
           const double from_m = r + pings * 0.5 * 1500.0 * interval_s;
           const double level_m = std::sqrt(from_m * from_m - altitude_m * altitude_m);
           const double to_side_m = side == Side::port ? -level_m : level_m;
           sum += along(pose, side, to_side_m, -altitude_m, -pings * interval_s) *
                  scatter::from_db(-2.0 * 0.03 * from_m) / (from_m * from_m * level_m);
         }
         return sum;
       }}};
  const Pose still;
  Pose rolls, yaws, dives, sails, all;
  rolls.roll_rate_radps = all.roll_rate_radps = 0.3;
  yaws.heading_rate_radps = all.heading_rate_radps = 0.04;
  dives.pitch_rate_radps = all.pitch_rate_radps = -0.05;
  sails.velocity_mps = all.velocity_mps = {0.0, 2.5, 0.0};
  double most_db = 0.0;
  for (const Path& path : paths)
    for (const Pose& pose : {rolls, yaws, dives, sails, all})
      for (const Side side : {Side::port, Side::starboard}) {
        const auto receive = [&](const Pose& motion) {
          return received(sonar, path.arrivals, {}, {.wind_mps = 0.0},
                          {.side = side, .motion = motion, .ping_interval_s = interval_s});
        };
        const std::vector<double> moved = receive(pose), at_rest = receive(still);
        for (const double r : {8.0, 20.0, 40.0, 70.0}) {
          if (r < depth_m && path.arrivals.surface) continue;
          const auto bin = static_cast<std::size_t>(r / sonar.bin_m());
          const double from_m = (static_cast<double>(bin) + 0.5) * sonar.bin_m() -
                                0.25 * 1500.0 * sonar.pulse.effective_length_s();
          const double expected_db =
              scatter::to_db(path.sum(pose, side, from_m) / path.sum(still, side, from_m));
          CAPTURE(path.name, static_cast<int>(side), r, pose.roll_rate_radps,
                  pose.heading_rate_radps, pose.pitch_rate_radps, pose.velocity_mps.y());
          CHECK(scatter::to_db(moved[bin] / at_rest[bin]) == Approx(expected_db).margin(0.1));
          most_db = std::max(most_db, std::abs(expected_db));
        }
      }
  CHECK(most_db > 3.0);
}

TEST_CASE("in open water, nearer than surface and bed, roll does not change the reverberation") {
  const Sonar sonar = quiet_sonar();
  for (const double roll_rad : {-0.7, 0.2, 1.4}) {
    const ArrayFrame array_frame{array, {0, 1, 0}, {-std::sin(roll_rad), 0.0, -std::cos(roll_rad)}};
    const std::vector<double> level = received(sonar, {.volume = true});
    const std::vector<double> rolled =
        received(sonar, {.volume = true}, {}, {}, {.array_frame = array_frame});
    for (std::size_t n = 0; (n + 1) * sonar.bin_m() < altitude_m; ++n)
      REQUIRE(rolled[n] == Approx(level[n]).epsilon(1e-9));
  }
}

TEST_CASE("a pitched array sees the surface, like the bed, at its distance over cos(pitch)") {
  const Sonar sonar = open_sonar();
  for (const double pitch_rad : {-0.35, 0.2}) {
    const Eigen::Vector3d ahead{0.0, std::cos(pitch_rad), std::sin(pitch_rad)};
    const ArrayFrame array_frame{array, ahead, {0.0, std::sin(pitch_rad), -std::cos(pitch_rad)}};
    const std::vector<double> surface =
        received(sonar, {.surface = true}, {}, {.wind_mps = 0.0}, {.array_frame = array_frame});
    const auto first = std::ranges::find_if(surface, [](double i) { return i > 0.0; });
    CHECK(double(first - surface.begin()) ==
          Approx(depth_m / std::cos(pitch_rad) / sonar.bin_m()).margin(1.0));
  }
}

TEST_CASE("multiples have the ranges of image sources, from below and from the side") {
  Sonar sonar = open_sonar();
  sonar.bins = 3000;
  // One place of the bed has an echo: straight below, or 20 m to the side.
  for (const double over_m : {0.5, 20.0}) {
    const double r = std::hypot(over_m, altitude_m);
    std::vector<float> direct(3000, 0.0f);
    const auto lit = static_cast<std::size_t>(r / sonar.bin_m());
    for (std::size_t i = lit - 2; i <= lit + 2; ++i) direct[i] = 1e9f;
    std::vector<double> all =
        received(sonar, {.multiples = true, .bottom_loss_db = 0.0}, direct, {.wind_mps = 0.0});
    for (std::size_t i = lit - 2; i <= lit + 2; ++i) all[i] -= 1e9;
    // The place is mirrored at the surface, and that image at the bed.
    const double by_surface = std::hypot(over_m, altitude_m + 2.0 * depth_m);
    const double by_bed = std::hypot(over_m, 3.0 * altitude_m + 2.0 * depth_m);
    std::vector<bool> explained(all.size());
    for (const double range_m : {0.5 * (r + by_surface), by_surface, 0.5 * (r + by_bed)}) {
      const auto bin = static_cast<std::size_t>(range_m / sonar.bin_m());
      CAPTURE(over_m, range_m);
      CHECK(*std::max_element(all.begin() + static_cast<std::ptrdiff_t>(bin) - 3,
                              all.begin() + static_cast<std::ptrdiff_t>(bin) + 4) > 1e3);
      for (std::size_t i = bin - 40; i < bin + 41 && i < all.size(); ++i) explained[i] = true;
    }
    for (std::size_t i = 0; i < all.size(); ++i)
      if (!explained[i]) REQUIRE(all[i] < 1e3);
  }
  // Their times, straight below: 2 (h + d) / c, 2 (h + 2 d) / c and (4 h + 2 d) / c.
  CHECK(0.5 * (altitude_m + (altitude_m + 2.0 * depth_m)) == altitude_m + depth_m);
}

TEST_CASE("a multiple by the surface keeps the energy of its legs' spreading") {
  Sonar sonar = open_sonar();
  sonar.bins = 3000;
  std::vector<float> direct(3000, 0.0f);
  const double over_m = 15.0, r = std::hypot(over_m, altitude_m);
  const auto lit = static_cast<std::size_t>(r / sonar.bin_m());
  for (std::size_t i = lit - 4; i <= lit + 4; ++i) direct[i] = 1e9f;
  const SeaState calm{.wind_mps = 0.0};
  const std::vector<double> with =
      received(sonar, {.multiples = true, .bottom_loss_db = 200.0}, direct, calm);
  const double back_m = std::hypot(over_m, altitude_m + 2.0 * depth_m);
  const auto sum_about = [&](double range_m) {
    const auto bin = static_cast<std::ptrdiff_t>(range_m / sonar.bin_m());
    return std::accumulate(with.begin() + bin - 20, with.begin() + bin + 21, 0.0);
  };
  // Two directions, each with r^2 r'^2 instead of r^4, and absorption over the longer leg. Along
  // the track sinc^2(L y / lambda r) sinc^2(L y / lambda r') has the integral
  // lambda r / L (1 - r / (3 r')), which for equal legs is 2/3 lambda r / L.
  const double wider = 1.5 * (1.0 - r / (3.0 * back_m));
  const double expected =
      9e9 * 2.0 * std::pow(r / back_m, 2) * wider * scatter::from_db(-0.03 * (back_m - r));
  CHECK(sum_about(0.5 * (r + back_m)) == Approx(expected).epsilon(0.02));
  // That of an image of the sonar at the range r': both legs are its own.
  const double as_image =
      9e9 * std::pow(r / back_m, 4) * (back_m / r) * scatter::from_db(-0.06 * (back_m - r));
  CHECK(sum_about(back_m) == Approx(as_image).epsilon(0.02));
}

TEST_CASE("multiples of an array that is not focused have the level of image sources") {
  // Each array is a row of points. Its field is summed over them with exact distances; the image at
  // the surface has the same field at its own range. The bed is level, of even strength.
  Sonar sonar = open_sonar();
  sonar.focused = false;
  sonar.bins = 3000;
  const double k = 2.0 * std::numbers::pi * sonar.frequency_hz / 1500.0;
  const auto field = [&](double length_m, double range_m, double along_m) {
    constexpr int points = 100;
    std::complex<double> sum = 0.0;
    for (int i = 0; i < points; ++i) {
      const double a = length_m * ((i + 0.5) / points - 0.5);
      sum += std::polar(1.0 / points, k * (std::hypot(range_m, along_m - a) - range_m));
    }
    return std::norm(sum);
  };
  const double up_m = altitude_m + 2.0 * depth_m;
  for (const double receiver_m : {0.5, 0.3}) {
    sonar.receive_array_length_m = receiver_m;
    struct Widths {
      double direct, once, twice;  // integrals along the track of both legs' patterns
    };
    constexpr double coarse_m = 0.5;
    std::vector<Widths> widths;
    for (double x_m = 0.0; x_m < 80.0; x_m += coarse_m) {
      const double r = std::hypot(x_m, altitude_m), back_m = std::hypot(x_m, up_m);
      Widths its{};
      constexpr int steps = 100;
      const double step_m = (sonar.array_length_m + 0.05 * back_m) / steps;
      for (int i = 0; i < steps; ++i) {
        const double y_m = (i + 0.5) * step_m;
        const double sent = field(sonar.array_length_m, r, y_m);
        const double sent_far = field(sonar.array_length_m, back_m, y_m);
        const double heard = field(receiver_m, r, y_m);
        const double heard_far = field(receiver_m, back_m, y_m);
        its.direct += 2.0 * step_m * sent * heard;
        its.once += step_m * (sent * heard_far + sent_far * heard);
        its.twice += 2.0 * step_m * sent_far * heard_far;
      }
      widths.push_back(its);
    }
    std::vector<float> direct(3000, 0.0f);
    std::vector<double> expected(3000, 0.0);
    const auto add = [&](auto& bins, double range_m, double energy) {
      const auto bin = static_cast<std::size_t>(range_m / sonar.bin_m());
      if (bin < bins.size()) bins[bin] += static_cast<float>(energy);
    };
    constexpr double fine_m = 1e-3;
    for (double x_m = 0.5 * fine_m; x_m < 79.0; x_m += fine_m) {
      const double r = std::hypot(x_m, altitude_m), back_m = std::hypot(x_m, up_m);
      const auto at = static_cast<std::size_t>(x_m / coarse_m);
      const double share = x_m / coarse_m - static_cast<double>(at);
      const auto width = [&](double Widths::*its) {
        return std::lerp(widths[at].*its, widths[at + 1].*its, share);
      };
      const auto spread = [&](double out, double back) {
        return 1e12 * fine_m / std::pow(out * back, 2) * scatter::from_db(-0.03 * (out + back));
      };
      add(direct, r, spread(r, r) * width(&Widths::direct));
      add(expected, 0.5 * (r + back_m), 2.0 * spread(r, back_m) * width(&Widths::once));
      add(expected, back_m, spread(back_m, back_m) * width(&Widths::twice));
    }
    const std::vector<double> all =
        received(sonar, {.multiples = true, .bottom_loss_db = 200.0}, direct, {.wind_mps = 0.0});
    for (const auto& [from_m, to_m] :
         {std::pair(24.5, 25.5), std::pair(26.0, 30.0), std::pair(32.0, 37.0),
          std::pair(38.5, 40.0), std::pair(42.0, 50.0), std::pair(60.0, 70.0)}) {
      double its = 0.0, summed = 0.0;
      for (auto n = static_cast<std::size_t>(from_m / sonar.bin_m()); n < to_m / sonar.bin_m();
           ++n) {
        its += all[n] - double(direct[n]);
        summed += expected[n];
      }
      CAPTURE(receiver_m, from_m, to_m);
      CHECK(scatter::to_db(its / summed) == Approx(0.0).margin(0.1));
    }
  }
}

TEST_CASE("multiples of a pitched or moving array have the level of image sources") {
  // The array's image at the surface is pitched the other way, so that its beam meets the bed
  // astern where the array's own meets it ahead. The bed is level, of even strength, cut into
  // squares; far away an array has the pattern sinc^2(L u / lambda). It is sent from the pose at
  // transmission and heard at the pose when the echo is back.
  Sonar sonar = open_sonar();
  sonar.bins = 3000;
  const double wavelength_m = 1500.0 / sonar.frequency_hz, up_m = altitude_m + 2.0 * depth_m;
  struct Case {
    double pitch_deg;
    Pose motion;
  };
  for (const auto& [pitch_deg, motion] :
       {Case{0.1, {}}, Case{0.25, {}}, Case{0.6, {}}, Case{3.0, {}},
        Case{0.1, {.velocity_mps = {0.0, 3.0, 0.0}}}, Case{-0.2, {.pitch_rate_radps = 0.04}},
        Case{0.0, {.heading_rate_radps = 0.03}},
        Case{0.1, {.velocity_mps = {0.0, 2.0, 0.0}, .pitch_rate_radps = -0.04}}}) {
    const double cosine = std::cos(pitch_deg * degree), sine = std::sin(pitch_deg * degree);
    std::vector<double> own(3000, 0.0), by_surface(3000, 0.0);
    const auto power = [&](double along, double range_m) {
      const double x = std::numbers::pi * sonar.array_length_m / wavelength_m * along / range_m;
      return std::abs(x) < 1e-6 ? 1.0 : std::pow(std::sin(x) / x, 2);
    };
    constexpr double square_m = 0.02;
    for (double x_m = 0.5 * square_m; x_m < 60.0; x_m += square_m)
      for (double y_m = -up_m * sine - 2.0; y_m < altitude_m * sine + 2.0; y_m += square_m) {
        const double r = std::hypot(x_m, y_m, altitude_m), back_m = std::hypot(x_m, y_m, up_m);
        Pose sent = motion;
        sent.pitch_rad = pitch_deg * degree;
        const auto leg = [&](double up, double after_s) {
          const Eigen::Vector3d place{x_m, y_m, up};
          return power(
              body_to_world(sent.after(after_s)).col(0).dot(place - after_s * motion.velocity_mps),
              place.norm());
        };
        // Both ways, if the receiver hears it on one leg and on the other.
        const auto two_way = [&](double out_up_m, double back_up_m, double range_m) {
          const double back_s = 2.0 * range_m / 1500.0;
          return leg(out_up_m, 0.0) * leg(back_up_m, back_s);
        };
        const auto add = [&](std::vector<double>& bins, double range_m, double length_m,
                             double share) {
          const auto bin = static_cast<std::size_t>(range_m / sonar.bin_m());
          if (bin < bins.size())
            bins[bin] += 1e9 * share / std::pow(length_m, 2) * scatter::from_db(-0.06 * range_m);
        };
        const double once_m = 0.5 * (r + back_m);
        add(own, r, r * r, two_way(-altitude_m, -altitude_m, r));
        add(by_surface, once_m, r * back_m,
            two_way(-altitude_m, up_m, once_m) + two_way(up_m, -altitude_m, once_m));
        add(by_surface, back_m, back_m * back_m, two_way(up_m, up_m, back_m));
      }
    const ArrayFrame array_frame{array, {0.0, cosine, sine}, {0.0, sine, -cosine}};
    const std::vector<double> all =
        received(sonar, {.multiples = true, .bottom_loss_db = 200.0}, {own.begin(), own.end()},
                 {.wind_mps = 0.0}, {.array_frame = array_frame, .motion = motion});
    for (const auto& [from_m, to_m] : {std::pair(25.0, 30.0), std::pair(30.0, 37.0),
                                       std::pair(39.0, 42.0), std::pair(45.0, 55.0)}) {
      double its = 0.0, summed = 0.0;
      for (auto n = static_cast<std::size_t>(from_m / sonar.bin_m()); n < to_m / sonar.bin_m();
           ++n) {
        its += all[n] - double(static_cast<float>(own[n]));
        summed += by_surface[n];
      }
      if (pitch_deg > 1.0 && from_m < up_m) continue;  // beyond the eighth null, where beams end
      CAPTURE(pitch_deg, from_m, to_m, motion.pitch_rate_radps, motion.heading_rate_radps,
              motion.velocity_mps.y());
      CHECK(scatter::to_db(its / summed) == Approx(0.0).margin(0.3));
    }
  }
}

TEST_CASE("a multiple loses the bubble loss of the wind at each reflection by the surface") {
  // APL-UW TR 9407: 15 dB per reflection at 400 kHz, 30 degrees, 10 m/s.
  CHECK(scatter::bubble_loss_db({.wind_mps = 10.0, .frequency_hz = 400e3},
                                std::numbers::pi / 6.0) == Approx(15.2).margin(0.1));
  Sonar sonar = open_sonar();
  sonar.bins = 3000;
  const double over_m = 10.0, r = std::hypot(over_m, altitude_m);
  std::vector<float> direct(3000, 0.0f);
  const auto lit = static_cast<std::size_t>(r / sonar.bin_m());
  for (std::size_t i = lit - 4; i <= lit + 4; ++i) direct[i] = 1e9f;
  const auto energies = [&](double wind_mps) {
    const std::vector<double> all =
        received(sonar, {.multiples = true, .bottom_loss_db = 0.0}, direct, {.wind_mps = wind_mps});
    std::array<double, 3> sums{};
    const double by_surface = std::hypot(over_m, altitude_m + 2.0 * depth_m);
    const double by_bed = std::hypot(over_m, 3.0 * altitude_m + 2.0 * depth_m);
    const double ranges[] = {0.5 * (r + by_surface), by_surface, 0.5 * (r + by_bed)};
    for (std::size_t i = 0; i < 3; ++i) {
      const auto bin = static_cast<std::ptrdiff_t>(ranges[i] / sonar.bin_m());
      sums[i] = std::accumulate(all.begin() + bin - 25, all.begin() + bin + 26, 0.0);
    }
    return sums;
  };
  const double surface_rad = std::atan2(altitude_m + 2.0 * depth_m, over_m);
  const double bed_rad = std::atan2(3.0 * altitude_m + 2.0 * depth_m, over_m);
  const auto calm = energies(0.0);
  for (const double wind_mps : {5.0, 7.0}) {
    const scatter::SeaSurface sea{.wind_mps = wind_mps, .frequency_hz = sonar.frequency_hz};
    const auto windy = energies(wind_mps);
    const double once_db = scatter::bubble_loss_db(sea, surface_rad);
    const double expected_db[] = {once_db, 2.0 * once_db, scatter::bubble_loss_db(sea, bed_rad)};
    for (std::size_t i = 0; i < 3; ++i) {
      CAPTURE(wind_mps, i);
      CHECK(-scatter::to_db(windy[i] / calm[i]) ==
            Approx(expected_db[i]).margin(0.3));  // waves lift the surface
    }
  }
}

TEST_CASE("a multiple by the bed loses the sediment's reflection loss at that angle") {
  Sonar sonar = open_sonar();
  sonar.bins = 3000;
  const SeaState calm{.wind_mps = 0.0};
  const scatter::Sediment sand = scatter::sediment_named("medium sand");
  for (const double over_m : {0.5, 20.0}) {
    std::vector<float> direct(3000, 0.0f);
    const double r = std::hypot(over_m, altitude_m);
    const auto lit = static_cast<std::size_t>(r / sonar.bin_m());
    for (std::size_t i = lit - 4; i <= lit + 4; ++i) direct[i] = 1e9f;
    const double down_m = 3.0 * altitude_m + 2.0 * depth_m, back_m = std::hypot(over_m, down_m);
    const auto energy = [&](std::optional<double> loss_db, std::optional<scatter::Sediment> bed) {
      const std::vector<double> all = received(
          sonar, {.multiples = true, .bottom_loss_db = loss_db}, direct, calm, {.bed = bed});
      const auto bin = static_cast<std::ptrdiff_t>(0.5 * (r + back_m) / sonar.bin_m());
      return std::accumulate(all.begin() + bin - 20, all.begin() + bin + 21, 0.0);
    };
    const double whole = energy(0.0, sand);
    const double loss_db = scatter::reflection_loss_db(sand, std::asin(down_m / back_m));
    CAPTURE(over_m, loss_db);
    CHECK(-scatter::to_db(energy({}, sand) / whole) == Approx(loss_db).margin(0.02));
    CHECK(-scatter::to_db(energy(6.0, sand) / whole) == Approx(6.0).margin(0.02));
    CHECK(-scatter::to_db(energy({}, {}) / whole) == Approx(10.0).margin(0.02));
    // |R(90)| of medium sand by the handbook's regressions is 0.369775.
    if (over_m < 1.0) CHECK(loss_db == Approx(-20.0 * std::log10(0.369775)).margin(0.05));
  }
}

TEST_CASE("a multiple has the bed's strength at both of its legs' grazing angles") {
  Sonar sonar = open_sonar();
  sonar.bins = 3000;
  const SeaState calm{.wind_mps = 0.0};
  const auto lambert = [](double sine) { return 2e-3 * sine * sine; };
  for (const double over_m : {5.0, 28.0, 60.0}) {
    const double r = std::hypot(over_m, altitude_m);
    std::vector<float> direct(3000, 0.0f);
    const auto lit = static_cast<std::size_t>(r / sonar.bin_m());
    for (std::size_t i = lit - 4; i <= lit + 4; ++i) direct[i] = 1e9f;
    const double up_m = altitude_m + 2.0 * depth_m, back_m = std::hypot(over_m, up_m);
    const auto energy = [&](const std::function<double(double)>& strength) {
      const std::vector<double> all = received(sonar, {.multiples = true, .bottom_loss_db = 200.0},
                                               direct, calm, {.strength = strength});
      const auto bin = static_cast<std::ptrdiff_t>(0.5 * (r + back_m) / sonar.bin_m());
      return std::accumulate(all.begin() + bin - 20, all.begin() + bin + 21, 0.0);
    };
    // Lambert's law: mu sin g sin g' over mu sin^2 g.
    const double expected_db = scatter::to_db((up_m / back_m) / (altitude_m / r));
    CAPTURE(over_m);
    CHECK(scatter::to_db(energy(lambert) / energy([](double) { return 2e-3; })) ==
          Approx(expected_db).margin(0.02));
  }
}

TEST_CASE("the ping before is heard from c P / 2 farther, by the sonar equation") {
  const Sonar sonar = open_sonar();
  const double ping_m = 90.0, interval_s = 2.0 * ping_m / 1500.0;
  const auto lambert = [](double sine) { return 2e-3 * sine * sine; };
  const std::vector<double> all = received(sonar, {.second_time_around = true}, {}, {},
                                           {.strength = lambert, .ping_interval_s = interval_s});
  const auto level = [&](double from_m) {
    const double sine = altitude_m / from_m;
    const double width = 2.0 / 3.0 * 1500.0 / sonar.frequency_hz / sonar.array_length_m;
    const double area_m2 =
        from_m * width * sonar.pulse.cell_m(1500.0) / std::sqrt(1.0 - sine * sine);
    return scatter::from_db(sonar.source_level_db - 40.0 * std::log10(from_m) -
                            2.0 * 0.03 * from_m) *
           area_m2 * lambert(sine);
  };
  for (const double r : {1.0, 20.0, 50.0, 74.0}) {
    double expected = 0.0;
    for (int pings = 1; pings <= 4; ++pings) expected += level(r + pings * ping_m);
    CAPTURE(r);
    CHECK(scatter::to_db(all[static_cast<std::size_t>(r / sonar.bin_m())]) ==
          Approx(scatter::to_db(expected)).epsilon(0).margin(0.05));
  }
  // Without an interval it is the two-way time of the range, 75 m. By default it is not heard.
  const std::vector<double> at_once =
      received(sonar, {.second_time_around = true}, {}, {}, {.strength = lambert});
  CHECK(scatter::to_db(at_once[100] / (level(80.0) + level(155.0))) == Approx(0.0).margin(0.1));
  for (const double none : received(sonar, {}, {}, {}, {.strength = lambert})) REQUIRE(none == 0.0);
  // Far below the noise nothing is added.
  Sonar noisy = sonar;
  noisy.receiver.noise = true;
  const auto without = received(noisy, {}, {}, {}, {.strength = lambert});
  CHECK(received(noisy, {.second_time_around = true}, {}, {},
                 {.strength = lambert, .ping_interval_s = 4.0}) == without);
  CHECK(received(noisy, {.second_time_around = true}, {}, {}, {.strength = lambert})[0] >
        without[0]);
}

TEST_CASE("the ping before is heard from beyond the range by the beam that the array has there") {
  // Out of focus a beam does not grow like the range, and behind a focus zone it grows faster. A
  // sonar with the same array and a longer range has the beam's width there, from its own table.
  struct Case {
    double length_m, receive_m, frequency_hz;
    std::vector<double> zones_m;
  };
  const double ping_m = 75.0;
  double most_db = 0.0;
  for (const Case& of : {Case{1.5, 0.0, 900e3, {}}, Case{1.0, 0.0, 400e3, {30.0}},
                         Case{1.0, 0.3, 400e3, {}}, Case{0.5, 0.0, 400e3, {}}}) {
    Sonar sonar = open_sonar();
    sonar.focused = false;
    sonar.array_length_m = of.length_m;
    sonar.receive_array_length_m = of.receive_m;
    sonar.frequency_hz = of.frequency_hz;
    sonar.focus_zones_m = of.zones_m;
    const std::vector<double> all = received(sonar, {.second_time_around = true}, {}, {},
                                             {.ping_interval_s = 2.0 * ping_m / 1500.0});
    // The integral of the exact patterns along the track.
    const LineArray sends = sonar.transmit_array(1500.0 / of.frequency_hz),
                    hears = sonar.receive_array(1500.0 / of.frequency_hz);
    const auto width_m = [&](double range_m) {
      const double reach_m = 0.5 * of.length_m * std::abs(sonar.defocus(range_m)) +
                             range_m * sends.null_rad(1);  // no rays go to the side lobes
      double sum = 0.0;
      for (int i = 0; i < 4000; ++i) {
        const double y = (i + 0.5) * reach_m / 4000.0;
        sum += sends.power(y / range_m, range_m, sonar.defocus(range_m)) *
               hears.power(y / range_m, range_m, sonar.defocus(range_m));
      }
      return sum * 2.0 * reach_m / 4000.0;
    };
    for (const double r : {5.0, 30.0, 70.0}) {
      const auto bin = static_cast<std::size_t>(r / sonar.bin_m());
      double expected = 0.0, in_proportion = 0.0;
      for (int pings = 1; pings <= 8; ++pings) {
        const double from_m = (static_cast<double>(bin) + 0.5) * sonar.bin_m() -
                              0.5 * sonar.pulse.cell_m(1500.0) + pings * ping_m;
        const double level = std::sqrt(1.0 - std::pow(altitude_m / from_m, 2));
        const double per_width = scatter::from_db(sonar.source_level_db - 2.0 * 0.03 * from_m) /
                                 std::pow(from_m, 4) * sonar.pulse.cell_m(1500.0) / level * 3e-4;
        expected += per_width * width_m(from_m);
        in_proportion += per_width * width_m(sonar.range_m) * from_m / sonar.range_m;
      }
      CAPTURE(of.length_m, of.frequency_hz, r);
      CHECK(scatter::to_db(all[bin] / expected) == Approx(0.0).margin(0.1));
      most_db = std::max(most_db, std::abs(scatter::to_db(in_proportion / expected)));
    }
  }
  CHECK(most_db > 1.0);
}

TEST_CASE("in water of another sound speed all other paths are at the ranges of their times") {
  // 4 % slower than the speed of the ranges: an echo from r is at 1500 / 1440 r, and a pulse covers
  // so much less.
  const double slow_mps = 1440.0, ping_m = 30.0;
  const Sonar sonar = open_sonar();
  const scatter::SoundSpeedProfile slow({{0.0, slow_mps}});
  Sonar in_slow = sonar;  // the same pings, in a sonar that knows the speed
  in_slow.range_m = sonar.range_m * slow_mps / 1500.0;
  const auto receive = [&](const Sonar& of, double sound_speed_mps,
                           const scatter::SoundSpeedProfile* profile,
                           const OtherPathsOptions& arrivals, const ArtefactOptions& artefacts) {
    Sonar same_beam = of;
    same_beam.array_length_m *= sound_speed_mps / 1500.0;
    const SignalChain chain(same_beam, {.speckle = false,
                                        .sound_speed_mps = sound_speed_mps,
                                        .profile = profile,
                                        .ping_interval_s = 2.0 * ping_m / 1500.0,
                                        .sea = {.wind_mps = 0.0},
                                        .arrivals = arrivals,
                                        .artefacts = artefacts});
    EchoLine line = level_line(of, Side::starboard, array, altitude_m);
    for (std::size_t n = 0; n < line.bins.intensity_mean.size(); ++n)
      line.bins.intensity_mean[n] =
          arrivals.multiples &&
                  (double(n) + 0.5) * of.bin_m() * (profile ? slow_mps / 1500.0 : 1.0) > altitude_m
              ? 1e9f
              : 0.0f;
    SignalChain::Memory memory;
    chain.receive(context, std::span(&line, 1), memory);
    std::vector<double> added;
    for (std::size_t n = 0; n < line.bins.intensity.size(); ++n)
      added.push_back(double(line.bins.intensity[n]) - double(line.bins.intensity_mean[n]));
    return added;
  };
  struct Case {
    const char* name;
    OtherPathsOptions arrivals;
    ArtefactOptions artefacts;
    double margin_db;
  };
  // The level of the water and of multiples goes by the range, not by the distance.
  const double goes_by_range_db = 3.0 * scatter::to_db(1500.0 / slow_mps) + 0.2;
  for (const Case& of :
       {Case{"surface", {.surface = true}, {}, 0.1},
        Case{"earlier", {.second_time_around = true}, {}, 0.1},
        Case{"water", {.volume = true}, {}, goes_by_range_db},
        Case{"multiples", {.multiples = true}, {}, goes_by_range_db},
        Case{"wake",
             {},
             {.wake_db = 0.0, .wake_heading_rad = 0.0, .wake_width_m = 20.0, .wake_offset_m = 30.0},
             0.1},
        Case{"fish", {}, {.fish_per_hectare = 3000.0}, 100.0}}) {  // their beam goes by the range
    const std::vector<double> by_time = receive(sonar, 1500.0, &slow, of.arrivals, of.artefacts),
                              known =
                                  receive(in_slow, slow_mps, nullptr, of.arrivals, of.artefacts);
    const auto first = [](const std::vector<double>& line) {
      return double(std::ranges::find_if(line, [](double i) { return i > 0.0; }) - line.begin());
    };
    CAPTURE(of.name);
    CHECK(first(by_time) == Approx(first(known)).margin(1.0));
    for (std::size_t n = 0; n < known.size(); ++n)
      if (known[n] > 0.0 && n > 20 + static_cast<std::size_t>(first(known))) {
        CAPTURE(n);
        REQUIRE(scatter::to_db(by_time[n] / known[n]) ==
                Approx(0.0).epsilon(0).margin(of.margin_db));
      }
  }
}

TEST_CASE("transmit leakage blinds the first samples and no others") {
  const Sonar sonar;
  const SignalChain chain(sonar, {.arrivals = {.burst_m = 0.4}});
  EchoLine line = level_line(sonar, Side::port, array, altitude_m);
  SignalChain::Memory memory;
  chain.receive(context, std::span(&line, 1), memory);
  CHECK(line.artefacts.has(Artefact::transmit_leakage));
  const std::uint32_t full = chain.recorder().full_scale();
  for (std::size_t i = 0; i < 8; ++i) CHECK(line.bins.sample[i] == full);  // 0.4 m
  for (std::size_t i = 30; i < 190; ++i) CHECK(line.bins.sample[i] < full / 10);
}

TEST_CASE("cross-talk from one side to the other has its level") {
  Sonar sonar = quiet_sonar();
  const SignalChain chain(sonar, {.speckle = false, .arrivals = {.crosstalk_db = -30.0}});
  EchoLine lines[] = {level_line(sonar, Side::port, array, altitude_m),
                      level_line(sonar, Side::starboard, array, altitude_m)};
  std::fill(lines[1].bins.intensity_mean.begin(), lines[1].bins.intensity_mean.end(), 0.0f);
  SignalChain::Memory memory;
  chain.receive(context, lines, memory);
  CHECK(lines[1].artefacts.has(Artefact::crosstalk));
  CHECK(lines[1].bins.intensity[600] == Approx(1e-3 * lines[0].bins.intensity[600]));
  CHECK(lines[0].bins.intensity[600] == Approx(1.0));

  // Without speckle the two sides' energies add, not their amplitudes.
  lines[1] = level_line(sonar, Side::starboard, array, altitude_m);
  chain.receive(context, lines, memory);
  CHECK(lines[1].bins.intensity[600] == Approx(1.0 + 1e-3));
}

TEST_CASE("cross-talk brings the other side's surface return, too") {
  Sonar sonar = open_sonar();
  const auto from_surface = [&](std::optional<double> crosstalk_db) {
    const SignalChain chain(
        sonar, {.speckle = false, .arrivals = {.surface = true, .crosstalk_db = crosstalk_db}});
    EchoLine lines[] = {level_line(sonar, Side::port, array, altitude_m),
                        level_line(sonar, Side::starboard, array, altitude_m)};
    for (EchoLine& line : lines) std::ranges::fill(line.bins.intensity_mean, 0.0f);
    SignalChain::Memory memory;
    chain.receive(context, lines, memory);
    return std::ranges::max(lines[1].bins.intensity);
  };
  CHECK(from_surface(-10.0) == Approx(1.1 * from_surface({})));
}

TEST_CASE("multiples do not follow from side lobes where a measured pattern hides the bed") {
  // The direct echo there is all side lobes; the multiples come from directions that are not
  // hidden.
  const auto loudest = [](double hidden_db) {
    Sonar sonar = open_sonar();
    sonar.bins = 3000;
    for (auto& side : sonar.vertical.measured)
      side = {{-180.0 * degree, 0.0},
              {60.0 * degree, 0.0},
              {61.0 * degree, hidden_db},
              {180.0 * degree, hidden_db}};
    std::vector<float> direct(3000, 0.0f);
    std::fill(direct.begin() + static_cast<std::ptrdiff_t>(altitude_m / sonar.bin_m()),
              direct.end(), 1.0f);
    std::vector<double> all = received(sonar, {.multiples = true}, direct, {.wind_mps = 0.0});
    return *std::ranges::max_element(all);
  };
  CHECK(loudest(-100.0) == Approx(loudest(-60.0)).epsilon(0.02));
}

namespace {

/// A wall on the bed. Its middle along the track is beside_m from that of the beam; its normal is
/// turned by turned_rad from facing the sonar, in the level.
struct Wall {
  double length_m = 40.0, turned_rad = 0.0, beside_m = 0.0, slope = 0.0;
};
constexpr double wall_away_m = 24.0, wall_height_m = 2.5;

/// The energy that a wall adds to a bed whose direct echo is 1 in each bin.
double corner_energy(const Sonar& sonar, const Circumstances& under, const Wall& wall,
                     double reflected = 1.0) {
  const SignalChain with(sonar, {.speckle = false,
                                 .nominal_strength = under.strength,
                                 .bed = under.bed,
                                 .arrivals = {.double_bounce = true}});
  EchoLine line = level_line(sonar, Side::starboard, array, altitude_m);
  line.walls = {{.middle = {wall_away_m, wall.beside_m, 0.5 * wall_height_m - altitude_m},
                 .normal = {-std::cos(wall.turned_rad), std::sin(wall.turned_rad), 0.0},
                 .length_m = wall.length_m,
                 .height_m = wall_height_m,
                 .reflected = reflected,
                 .slope = wall.slope}};
  SignalChain::Memory memory;
  with.receive(context, std::span(&line, 1), memory);
  double added = 0.0;
  for (std::size_t i = 0; i < line.bins.intensity.size(); ++i) {
    const double its = double(line.bins.intensity[i]) - double(line.bins.intensity_mean[i]);
    // The paths are nearly as long as that to the wall's foot.
    const double foot_m = std::hypot(wall_away_m, altitude_m);
    if (std::abs(line.bins.range_m[i] - foot_m) > 0.5) REQUIRE(std::abs(its) < 1e-3);
    added += its;
  }
  return added;
}

/// The same by a sum over the bed. Sound that reaches a place of it over the wall has come from the
/// place's own mirror image behind the wall, if the line there passes through the wall; it has the
/// array's far-field beam in that direction. Each place has two paths, whose amplitudes add.
template <class Direct, class Bistatic>
double mirrored_energy(const Sonar& sonar, const Wall& wall, Direct&& direct, Bistatic&& bistatic) {
  const double per_m = sonar.frequency_hz / 1500.0 * sonar.array_length_m;
  const auto beam = [&](double along_m, double range_m) {
    const double a = std::numbers::pi * per_m * along_m / range_m;
    return std::abs(a) < 1e-6 ? 1.0 : std::pow(std::sin(a) / a, 2);
  };
  const Eigen::Vector3d sonar_at(0.0, 0.0, altitude_m);
  const Eigen::Vector3d normal(-std::cos(wall.turned_rad), std::sin(wall.turned_rad), 0.0);
  const Eigen::Vector3d level(std::sin(wall.turned_rad), std::cos(wall.turned_rad), 0.0);
  const Eigen::Vector3d foot(wall_away_m, wall.beside_m, 0.0);
  constexpr double step_m = 0.05, aside_m = 0.01;
  double sum = 0.0;
  for (double x_m = 0.5 * step_m; x_m < wall_away_m + 1.0; x_m += step_m) {
    const double range_m = std::hypot(x_m, altitude_m);
    double across = 0.0;
    for (double y_m = -1.0 + 0.5 * aside_m; y_m < 1.0; y_m += aside_m) {
      const Eigen::Vector3d place(x_m, y_m, 0.0);
      const double before_m = (place - foot).dot(normal);
      if (before_m < 0.0) continue;
      const Eigen::Vector3d image = place - 2.0 * before_m * normal, way = image - sonar_at;
      const Eigen::Vector3d met =
          sonar_at + (foot - sonar_at).dot(normal) / way.dot(normal) * way - foot;
      if (met.z() > wall_height_m || std::abs(met.dot(level)) > 0.5 * wall.length_m) continue;
      const double g_in = std::asin(altitude_m / way.norm()), g = std::asin(altitude_m / range_m);
      // By how much the sound changes its azimuth on the bed.
      const Eigen::Vector3d arrives = way - 2.0 * way.dot(normal) * normal;
      const double turned = std::atan2(arrives.y(), -arrives.x()) - std::atan2(-y_m, x_m);
      across += aside_m * beam(image.y(), way.norm()) * beam(y_m, range_m) *
                bistatic(g_in, g, turned) / direct(g) * std::pow(range_m / way.norm(), 2);
    }
    const double bins = step_m * x_m / range_m / sonar.bin_m();
    sum += 4.0 * bins * across / (2.0 / 3.0 * range_m / per_m);
  }
  return sum;
}

double lambert(double sine) { return 3e-4 * sine * sine; }
double mirrored_by_lambert(const Sonar& sonar, const Wall& wall) {
  return mirrored_energy(
      sonar, wall, [](double g) { return std::pow(std::sin(g), 2.0); },
      [](double a, double b, double) { return std::sin(a) * std::sin(b); });
}

}  // namespace

TEST_CASE("a wall's foot has the echo of the bed that it mirrors, both ways in phase") {
  // By Lambert's law, of mu sin g sin g'; two paths that add in amplitude make four times the
  // energy of one.
  const Sonar sonar = open_sonar();
  CHECK(corner_energy(sonar, {.strength = lambert}, {}) ==
        Approx(mirrored_by_lambert(sonar, {})).epsilon(0.04));
  CHECK(corner_energy(sonar, {.strength = lambert}, {}, 0.1) ==
        Approx(0.1 * corner_energy(sonar, {.strength = lambert}, {})).epsilon(0.01));
}

TEST_CASE("a wall that is oblique or beside the beam mirrors less of the bed") {
  const Sonar sonar = open_sonar();
  const double whole = corner_energy(sonar, {.strength = lambert}, {});
  for (const Wall& wall :
       {Wall{.turned_rad = 0.5 * degree}, Wall{.turned_rad = 2.0 * degree},
        Wall{.turned_rad = -5.0 * degree}, Wall{.length_m = 1.0, .beside_m = 0.5},
        Wall{.length_m = 0.4, .beside_m = 0.2}, Wall{.length_m = 1.0, .beside_m = 0.7},
        Wall{.length_m = 0.4, .turned_rad = 1.0 * degree, .beside_m = 0.1}}) {
    const double expected = mirrored_by_lambert(sonar, wall);
    CAPTURE(wall.length_m, wall.turned_rad / degree, wall.beside_m, whole, expected);
    CHECK(corner_energy(sonar, {.strength = lambert}, wall) ==
          Approx(expected).epsilon(0.08).margin(0.01 * whole));
    CHECK(expected < 0.9 * whole);
  }
  // From 45 degrees on, and from its back, it mirrors none.
  for (const double turned_deg : {46.0, 90.0, 180.0})
    CHECK(corner_energy(sonar, {.strength = lambert}, {.turned_rad = turned_deg * degree}) == 0.0);
}

TEST_CASE("a wall that is narrower than the beam mirrors by its width, with diffraction") {
  // In the plane of the sound: the field of the array's points on the wall, and from there on the
  // bed, by Huygens's sum. Over the field of the array's image it is 1 behind a wide wall.
  const Sonar sonar = open_sonar();
  const double wavelength_m = 1500.0 / sonar.frequency_hz,
               k = 2.0 * std::numbers::pi / wavelength_m;
  const double per_m = sonar.array_length_m / wavelength_m;
  const auto beam = [&](double along_m, double range_m) {
    const double a = std::numbers::pi * per_m * along_m / range_m;
    return std::abs(a) < 1e-6 ? 1.0 : std::pow(std::sin(a) / a, 2);
  };
  const auto by_diffraction = [&](const Wall& wall) {
    // The array is focused: its field on the wall has the far field's amplitude, in the phase of a
    // wave from its middle.
    constexpr double part_m = 1e-3, aside_m = 0.01, step_m = 0.25;
    double sum = 0.0;
    for (double before_m = 0.5 * step_m; before_m < 8.0; before_m += step_m) {
      const double x_m = wall_away_m - before_m, range_m = std::hypot(x_m, altitude_m);
      const double height_m = altitude_m * before_m / (wall_away_m + before_m);
      if (height_m > wall_height_m) break;
      const double image_m = std::hypot(wall_away_m + before_m, altitude_m);
      const double first_m = image_m * wall_away_m / (wall_away_m + before_m),
                   last_m = image_m - first_m;
      double across = 0.0;
      for (double y_m = -1.5; y_m < 1.5; y_m += aside_m) {
        std::complex<double> field = 0.0;
        for (double u = wall.beside_m - 0.5 * wall.length_m + 0.5 * part_m;
             u < wall.beside_m + 0.5 * wall.length_m; u += part_m) {
          const double amplitude = std::sqrt(beam(u, first_m));
          field += part_m * std::polar(amplitude, k * (0.5 * u * u / first_m +
                                                       0.5 * (y_m - u) * (y_m - u) / last_m));
        }
        across += aside_m * beam(y_m, range_m) * std::norm(field) * image_m /
                  (wavelength_m * first_m * last_m);
      }
      const double sines = (altitude_m / image_m) / (altitude_m / range_m);
      sum += 4.0 * step_m * x_m / range_m / sonar.bin_m() * across * sines *
             std::pow(range_m / image_m, 2) / (2.0 / 3.0 * range_m / per_m);
    }
    return sum;
  };
  for (const Wall& wall : {Wall{.length_m = 0.3}, Wall{.length_m = 0.15}, Wall{.length_m = 0.08},
                           Wall{.length_m = 0.04}, Wall{.length_m = 0.1, .beside_m = 0.1}}) {
    CAPTURE(wall.length_m, wall.beside_m);
    CHECK(corner_energy(sonar, {.strength = lambert}, wall) / by_diffraction(wall) ==
          Approx(1.0).epsilon(0.2));
  }
}

TEST_CASE(
    "a rough wall mirrors as smooth ones do of which each is turned by a part of its slopes") {
  const Sonar sonar = open_sonar();
  for (const double slope : {0.02, 0.1}) {
    double expected = 0.0;
    constexpr int steps = 40;
    for (int i = 0; i < steps; ++i) {
      const double sigmas = -3.0 + 6.0 * (i + 0.5) / steps;
      expected += mirrored_by_lambert(sonar, {.turned_rad = std::atan(sigmas * slope)}) *
                  std::exp(-0.5 * sigmas * sigmas) * 6.0 / steps /
                  std::sqrt(2.0 * std::numbers::pi);
    }
    CAPTURE(slope);
    CHECK(corner_energy(sonar, {.strength = lambert}, {.slope = slope}) ==
          Approx(expected).epsilon(0.1));
  }
}

TEST_CASE("a wall's corner with medium sand has the bed's lobe, by Kirchhoff's integral") {
  // The integral for q = k_out - k_in at the specular point, |R|^2 (k_z^2 / 2 pi) Gamma(1/a) / (2
  // a) (2 k_z^2 Ch2)^(-1/a), k_z = k sin g; across the strip the angles differ by 5 degrees, far
  // less than the lobe's width.
  Sonar sonar = open_sonar();
  sonar.frequency_hz = 400e3;
  const scatter::Sediment sand = scatter::sediment_named("medium sand");
  const double k = scatter::wavenumber_per_cm(sonar.frequency_hz, 1500.0), a = sand.alpha();
  const double Ch2 = scatter::kirchhoff_shape(sand, k).Ch2;
  const scatter::Bottom bottom(sand, sonar.frequency_hz, 1500.0);
  const auto direct = [&](double g) { return bottom.cross_section(g); };
  const auto lobe = [&](double g_in, double g, double) {
    const double mean = 0.5 * (g_in + g), k_z = k * std::sin(mean);
    return std::norm(scatter::reflection_coefficient(sand, mean)) * k_z * k_z /
               (2.0 * std::numbers::pi) * std::tgamma(1.0 / a) / (2.0 * a) *
               std::pow(2.0 * k_z * k_z * Ch2, -1.0 / a) +
           std::sqrt(direct(g_in) * direct(g));
  };
  const double energy = corner_energy(
      sonar, {.bed = sand, .strength = [&](double sine) { return direct(std::asin(sine)); }}, {});
  CHECK(scatter::to_db(energy) ==
        Approx(scatter::to_db(mirrored_energy(sonar, {}, direct, lobe))).margin(0.2));
  // The lobe is some 18 dB above backscatter at 20 degrees.
  const double g = 20.0 * std::numbers::pi / 180.0;
  CHECK(scatter::to_db(lobe(g, g, 0.0) / direct(g)) == Approx(18.0).margin(3.0));
  // An oblique wall sends the sound to the array by a facet of the bed that is inclined to the
  // side.
  const Wall oblique{.turned_rad = 3.0 * std::numbers::pi / 180.0};
  const double of_oblique = corner_energy(
      sonar, {.bed = sand, .strength = [&](double sine) { return direct(std::asin(sine)); }},
      oblique);
  const double expected =
      mirrored_energy(sonar, oblique, direct, [&](double g_in, double g_out, double turned) {
        return scatter::forward_lobe(sand, k, g_in, g_out, turned) +
               std::sqrt(direct(g_in) * direct(g_out));
      });
  CHECK(scatter::to_db(of_oblique / expected) == Approx(0.0).margin(0.5));
  CHECK(of_oblique < 0.3 * energy);
}
