// Times and levels of the sound that is received in addition to the direct echo; earlier pings are
// in earlier_pings_test.cpp.

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>
#include <vector>

#include "support/catch.h"
#include "support/lines.h"
#include "support/other_paths.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/surface_scatter.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

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
  SignalChain::Scratch scratch;
  EchoLine line;
  line.bins.assign(7500);
  double sum = 0.0, squares = 0.0;
  constexpr int pings = 2000;
  for (int ping = 0; ping < pings; ++ping) {
    LineContext now = context;
    now.t_s = 0.37 * ping;
    receive_lines(chain, now, std::span(&line, 1), scratch);
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

TEST_CASE("few scatterers in the water make a K distributed echo of the same mean") {
  const Sonar sonar = open_sonar();
  constexpr double per_m3 = 4.0;
  const std::vector<double> mean = received(sonar, {.volume = true});
  const SignalChain chain(sonar, {.speckle = true,
                                  .absorption_db_per_m = 0.03,
                                  .sea = {.volume_scatterers_per_m3 = per_m3},
                                  .arrivals = {.volume = true}});
  SignalChain::Scratch scratch;
  EchoLine line = level_line(sonar, starboard_sector, array, altitude_m);
  constexpr int pings = 4000;
  constexpr std::size_t near = 20;  // bins whose moments are averaged
  for (const double r : {6.0, 20.0, 60.0}) {
    const auto first = static_cast<std::size_t>(r / sonar.bin_m());
    double sum = 0.0, squares = 0.0;
    for (int ping = 0; ping < pings; ++ping) {
      std::ranges::fill(line.bins.intensity_mean, 0.0f);
      LineContext now = context;
      now.ping = static_cast<std::uint64_t>(ping);
      receive_lines(chain, now, std::span(&line, 1), scratch);
      for (std::size_t n = first; n < first + near; ++n) {
        const double share = line.bins.intensity[n] / mean[n];
        sum += share / (pings * near);
        squares += share * share / (pings * near);
      }
    }
    // The volume is the volume of the test of the mean above. With n scatterers, <I^2> / <I>^2 = 2
    // (1 + 1 / n).
    const double middle_m = r + 0.5 * near * sonar.bin_m();
    const double angle = 2.0 / 3.0 * 1500.0 / sonar.frequency_hz / sonar.array_length_m;
    const double around = 2.0 * (std::asin(std::min(depth_m / middle_m, 1.0)) +
                                 std::asin(std::min(altitude_m / middle_m, 1.0)));
    const double count = per_m3 * angle * around * middle_m * middle_m * 0.5 * 1500.0 *
                         sonar.pulse.effective_length_s();
    CAPTURE(r, count);
    CHECK(sum == Approx(1.0).epsilon(0.05));
    CHECK(squares / (sum * sum) == Approx(2.0 * (1.0 + 1.0 / count)).epsilon(0.1));
  }
}

TEST_CASE("volume reverberation nearer than the array is long is that of a sum over its elements") {
  constexpr double array_m = 1.0, wavelength_m = 1500.0 / 400e3;
  constexpr double k = 2.0 * std::numbers::pi / wavelength_m;
  Sonar sonar = open_sonar();
  sonar.frequency_hz = 400e3;
  sonar.array_length_m = array_m;
  sonar.range_m = 10.0;
  sonar.bins = 1000;
  for (const bool focused : {true, false}) {
    sonar.focused = focused;
    const std::vector<double> volume = received(sonar, {.volume = true});
    // The integral over a sphere of the fourth power of the field of all elements.
    const auto expected = [&](double r) {
      constexpr int elements = 400, rings = 8000;
      const double reach_rad = std::asin(0.9 * array_m / r > 1.0 ? 1.0 : 0.9 * array_m / r);
      double sum = 0.0;
      for (int ring = 0; ring < rings; ++ring) {
        const double psi = reach_rad * (ring + 0.5) / rings;
        std::complex<double> field = 0.0;
        for (int i = 0; i < elements; ++i) {
          const double at_m = array_m * ((i + 0.5) / elements - 0.5);
          const double path_m = std::hypot(r * std::cos(psi), r * std::sin(psi) - at_m);
          const double delay_m = focused ? std::hypot(r, at_m) : r;
          field += std::polar(1.0 / (elements * path_m), k * (path_m - delay_m));
        }
        sum += std::pow(std::norm(field), 2) * r * r * std::cos(psi) * reach_rad / rings;
      }
      return sum;
    };
    const auto got = [&](double r) {
      return volume[static_cast<std::size_t>(r / sonar.bin_m())] * scatter::from_db(2.0 * 0.03 * r);
    };
    const double far_m = 4.0 * array_m;
    for (const double r : {0.6, 0.75, 1.0}) {
      CAPTURE(focused, r);
      CHECK(scatter::to_db(got(r) / got(far_m)) ==
            Approx(scatter::to_db(expected(r) / expected(far_m))).margin(1.0));
    }
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
    for (const Sector& sector : sidescan_sectors) {
      const auto receive = [&](const Sonar& sonar, const ArrayFrame& array_frame) {
        const bool bed = what.arrivals.multiples;
        const SeaState sea = bed ? SeaState{.wind_mps = 0.0} : SeaState{};  // a mirror
        return received(
            sonar, what.arrivals, bed ? direct : std::vector<float>{}, sea,
            {.sector = sector, .array_frame = array_frame, .artefacts = what.artefacts});
      };
      const std::vector<double> by_roll = receive(upright, rolled),
                                by_mount = receive(mounted, level);
      CAPTURE(what.name, sector.name);
      double changed = 0.0;
      const std::vector<double> unrolled = receive(upright, level);
      for (std::size_t n = 0; n < by_roll.size(); ++n) {
        REQUIRE(by_roll[n] == Approx(by_mount[n]).epsilon(2e-3).margin(1e-30));
        if (unrolled[n] > 0.0)
          changed = std::max(changed, std::abs(by_roll[n] - unrolled[n]) / unrolled[n]);
      }
      const bool nothing_there = what.artefacts.wake_db && sector.number == 0;
      CHECK((nothing_there || changed > 0.02));
    }
}

TEST_CASE(
    "surface, water and earlier pings are received by the beam where it is when they are back") {
  // The beam in each direction, sent from the pose at transmission and received at the pose when
  // the echo is back, is summed over the place of each bin. The array heads north.
  Sonar sonar = quiet_sonar();
  sonar.focused = true;
  const double wavelength_m = 1500.0 / sonar.frequency_hz, interval_s = 0.1;
  const LineArray line{sonar.array_length_m, wavelength_m};
  const auto power = [&](const Pose& pose, const Sector& sector, const Eigen::Vector3d& to) {
    const Eigen::Vector3d in_body = body_to_world(pose).transpose() * to.normalized();
    const double abeam = (sector.number == 0 ? -1.0 : 1.0) * in_body.y();
    return line.power(in_body.x()) * sonar.vertical.power(std::atan2(in_body.z(), abeam), sector);
  };
  // Of the line along the track through a place in the plane abeam.
  const auto along = [&](const Pose& pose, const Sector& sector, double level_m, double up_m,
                         double sent_s) {
    const double range_m = std::hypot(level_m, up_m), null_m = range_m * line.null_rad(1);
    const double back_s = 2.0 * range_m / 1500.0;
    double sum = 0.0;
    for (double y = -3.995; y < 4.0; y += 0.01) {
      const Eigen::Vector3d place{level_m, y * null_m, up_m};
      sum += power(pose.after(sent_s), sector, place) *
             power(pose.after(sent_s + back_s), sector, place - back_s * pose.velocity_mps);
    }
    return sum;
  };
  struct Path {
    const char* name;
    OtherPathsOptions arrivals;
    std::function<double(const Pose&, const Sector&, double range_m)> sum;
  };
  const Path paths[] = {
      {"surface",
       {.surface = true},
       [&](const Pose& pose, const Sector& sector, double r) {
         const double level_m = std::sqrt(r * r - depth_m * depth_m);
         return along(pose, sector, level_m, depth_m, 0.0) +
                along(pose, sector, -level_m, depth_m, 0.0);
       }},
      {"water",
       {.volume = true},
       [&](const Pose& pose, const Sector& sector, double r) {
         double sum = 0.0;
         for (int i = 0; i < 360; ++i) {
           const double turn_rad = (i + 0.5) * degree;
           const double level_m = r * std::cos(turn_rad), up_m = r * std::sin(turn_rad);
           if (up_m < depth_m && up_m > -altitude_m) sum += along(pose, sector, level_m, up_m, 0.0);
         }
         return sum;
       }},
      {"earlier ping",
       {.second_time_around = true},
       [&](const Pose& pose, const Sector& sector, double r) {
         double sum = 0.0;
         for (int pings = 1; pings <= 8; ++pings) {
           const double from_m = r + pings * 0.5 * 1500.0 * interval_s;
           const double level_m = std::sqrt(from_m * from_m - altitude_m * altitude_m);
           const double to_side_m = sector.number == 0 ? -level_m : level_m;
           sum += along(pose, sector, to_side_m, -altitude_m, -pings * interval_s) *
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
  double max_db = 0.0;
  for (const Path& path : paths)
    for (const Pose& pose : {rolls, yaws, dives, sails, all})
      for (const Sector& sector : sidescan_sectors) {
        const auto receive = [&](const Pose& motion) {
          return received(sonar, path.arrivals, {}, {.wind_mps = 0.0},
                          {.sector = sector, .motion = motion, .ping_interval_s = interval_s});
        };
        const std::vector<double> moved = receive(pose), at_rest = receive(still);
        for (const double r : {8.0, 20.0, 40.0, 70.0}) {
          if (r < depth_m && path.arrivals.surface) continue;
          const auto bin = static_cast<std::size_t>(r / sonar.bin_m());
          const double from_m = (static_cast<double>(bin) + 0.5) * sonar.bin_m() -
                                0.25 * 1500.0 * sonar.pulse.effective_length_s();
          const double expected_db =
              scatter::to_db(path.sum(pose, sector, from_m) / path.sum(still, sector, from_m));
          CAPTURE(path.name, sector.name, r, pose.roll_rate_radps, pose.heading_rate_radps,
                  pose.pitch_rate_radps, pose.velocity_mps.y());
          CHECK(scatter::to_db(moved[bin] / at_rest[bin]) == Approx(expected_db).margin(0.1));
          max_db = std::max(max_db, std::abs(expected_db));
        }
      }
  CHECK(max_db > 3.0);
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
    // The edge of the beam is a little nearer.
    const LineArray line{sonar.array_length_m, 1500.0 / sonar.frequency_hz};
    const double edge_m = depth_m / std::cos(std::abs(pitch_rad) - line.null_rad(1));
    const double first_m = double(first - surface.begin()) * sonar.bin_m();
    CHECK(first_m > edge_m - sonar.bin_m());
    CHECK(first_m < depth_m / std::cos(pitch_rad) + sonar.bin_m());
  }
}

TEST_CASE("the surface's first cells have the energy of the places that lie in them") {
  // Summed over points of the surface about the line in which the beam's plane cuts it. The array
  // heads north. The middle of a pitched one's beam sees no place with a grazing angle above 90
  // degrees - pitch, where a calm sea's lobe has fallen by many decibels; an edge of a wide beam
  // does.
  Sonar sonar = open_sonar();
  sonar.frequency_hz = 100e3;
  const double bin_m = sonar.bin_m();
  Pulse cw, brief, sweep;
  cw.length_s = 4e-4;
  brief.length_s = 2e-5;  // its cell is shorter than a bin
  sweep.kind = PulseKind::lfm;
  sweep.bandwidth_hz = 3e3;
  struct Case {
    double wind_mps, pitch_deg;
    Pulse pulse;
    double array_length_m = 2.0;  // the lobe changes little over the beam
  };
  for (const Case& of :
       {Case{0.0, 10.0, cw, 0.5}, Case{0.0, -10.0, brief, 0.5}, Case{0.0, 5.0, sweep, 0.4},
        Case{4.0, 10.0, cw, 0.4}, Case{0.0, 0.0, cw}, Case{0.0, 10.0, cw}, Case{0.0, 20.0, cw},
        Case{4.0, 0.0, cw}, Case{4.0, 10.0, cw}, Case{0.0, 0.0, brief}, Case{0.0, 10.0, brief},
        Case{4.0, 10.0, brief}, Case{0.0, 0.0, sweep}, Case{0.0, 10.0, sweep},
        Case{4.0, 10.0, sweep}}) {
    sonar.pulse = of.pulse;
    sonar.array_length_m = of.array_length_m;
    const LineArray line{sonar.array_length_m, 1500.0 / sonar.frequency_hz};
    const double null_rad = line.null_rad(1);
    const double cell_m = sonar.pulse.cell_m(1500.0), pitch_rad = of.pitch_deg * degree;
    const Eigen::Vector3d ahead{0.0, std::cos(pitch_rad), std::sin(pitch_rad)};
    const std::vector<double> surface =
        received(sonar, {.surface = true}, {}, {.wind_mps = of.wind_mps},
                 {.array_frame = {array, ahead, {0.0, ahead.z(), -ahead.y()}}});
    // An echo fills the bins about it, or behind it, over a cell or a bin.
    const double length_m = std::max(cell_m, bin_m),
                 behind_m = of.pulse.kind == PulseKind::cw ? 0.5 * cell_m : 0.0;
    const double slant_m = depth_m / ahead.y(), end_m = 1.2 * slant_m;
    std::vector<double> expected(surface.size());
    constexpr double step_m = 0.01;
    for (double x_m = 0.5 * step_m; std::hypot(x_m, slant_m) < end_m; x_m += step_m) {
      const double reach_m = 1.1 * std::hypot(x_m, slant_m) * null_rad / ahead.y();
      constexpr int points = 100;
      for (int i = 0; i < points; ++i) {
        const double y_m = ((2.0 * i + 1.0) / points - 1.0) * reach_m - slant_m * ahead.z();
        const Eigen::Vector3d place{x_m, y_m, depth_m};
        const double range_m = place.norm(), along = ahead.dot(place) / range_m;
        if (std::abs(along) > null_rad) continue;
        const double strength = scatter::surface_cross_section(
            {.wind_mps = of.wind_mps, .frequency_hz = sonar.frequency_hz},
            std::asin(depth_m / range_m));
        const double area_m2 = 2.0 * step_m * 2.0 * reach_m / points;  // port and starboard
        const double intensity =
            cell_m / length_m * area_m2 * strength * std::pow(line.power(along), 2) *
            scatter::from_db(sonar.source_level_db - 2.0 * 0.03 * range_m) / std::pow(range_m, 4);
        const double first = (range_m + behind_m - 0.5 * length_m) / bin_m - 0.5;
        for (double n = std::ceil(first); n < first + length_m / bin_m; n += 1.0)
          expected[static_cast<std::size_t>(n)] += intensity;
      }
    }
    const double first_m = slant_m + behind_m - 0.5 * length_m;
    std::vector<double> ends_m{first_m + 0.5 * length_m, first_m + length_m + 0.03 * slant_m,
                               end_m - length_m};
    if (of.wind_mps > 0.0) ends_m = {end_m - length_m};  // waves of some decimetres
    double begin_m = first_m - 1.0;
    for (const double until_m : ends_m) {
      double sum = 0.0, its = 0.0;
      for (std::size_t n = 0; n < expected.size(); ++n) {
        const double range_m = (static_cast<double>(n) + 0.5) * bin_m;
        if (range_m > begin_m && range_m < until_m + 0.5 * bin_m)
          sum += surface[n], its += expected[n];
      }
      CAPTURE(of.wind_mps, of.pitch_deg, of.array_length_m, cell_m, begin_m, until_m);
      CHECK(scatter::to_db(sum / its) == Approx(0.0).margin(0.3));
      begin_m = until_m + 0.5 * bin_m;
    }
  }
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
    EchoLine line = level_line(in_slow, starboard_sector, array, altitude_m);
    line.walls = {{.middle = {24.0, 0.0, 1.25 - altitude_m},
                   .normal = {-1.0, 0.0, 0.0},
                   .length_m = 40.0,
                   .height_m = 2.5,
                   .reflected = 1.0}};
    for (std::size_t n = 0; n < line.bins.intensity_mean.size(); ++n)
      line.bins.intensity_mean[n] =
          arrivals.double_bounce ||
                  (arrivals.multiples &&
                   (double(n) + 0.5) * of.bin_m() * (profile ? slow_mps / 1500.0 : 1.0) >
                       altitude_m)
              ? 1e9f
              : 0.0f;
    SignalChain::Scratch scratch;
    receive_lines(chain, context, std::span(&line, 1), scratch);
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
        Case{"fish", {}, {.fish_per_hectare = 3000.0}, 3.0}}) {  // their beam goes by the range
    const std::vector<double> by_time = receive(sonar, 1500.0, &slow, of.arrivals, of.artefacts),
                              known =
                                  receive(in_slow, slow_mps, nullptr, of.arrivals, of.artefacts);
    const auto first = [](const std::vector<double>& line) {
      return double(std::ranges::find_if(line, [](double i) { return i > 0.0; }) - line.begin());
    };
    CAPTURE(of.name);
    CHECK(first(by_time) == Approx(first(known)).margin(1.0));
    // Not of fish at the beam's edge, where its width counts.
    const auto over_spreading = [&](std::size_t n) {
      return known[n] * std::pow(static_cast<double>(n), 4.0);
    };
    double strongest = 0.0;
    for (std::size_t n = 0; n < known.size(); ++n)
      strongest = std::max(strongest, over_spreading(n));
    const double least = of.artefacts.fish_per_hectare > 0.0 ? 0.01 * strongest : 0.0;
    for (std::size_t n = 0; n < known.size(); ++n)
      if (over_spreading(n) > least && n > 20 + static_cast<std::size_t>(first(known))) {
        CAPTURE(n);
        REQUIRE(scatter::to_db(by_time[n] / known[n]) ==
                Approx(0.0).epsilon(0).margin(of.margin_db));
      }
  }
  // A wall's echo lies in a few bins.
  const std::vector<double> by_time = receive(sonar, 1500.0, &slow, {.double_bounce = true}, {}),
                            known =
                                receive(in_slow, slow_mps, nullptr, {.double_bounce = true}, {});
  const auto sums = [](const std::vector<double>& line) {
    double energy = 0.0, bins = 0.0;
    for (std::size_t n = 0; n < line.size(); ++n)
      energy += line[n], bins += static_cast<double>(n) * line[n];
    return std::pair(energy, bins / energy);
  };
  CHECK(sums(known).second * in_slow.bin_m() == Approx(std::hypot(24.0, altitude_m)).margin(0.3));
  CHECK(sums(by_time).second == Approx(sums(known).second).margin(0.1));
  CHECK(scatter::to_db(sums(by_time).first / sums(known).first) ==
        Approx(0.0).epsilon(0).margin(goes_by_range_db));
}

TEST_CASE("transmit leakage blinds the first samples and no others") {
  const Sonar sonar;
  const SignalChain chain(sonar, {.arrivals = {.burst_m = 0.4}});
  EchoLine line = level_line(sonar, port_sector, array, altitude_m);
  SignalChain::Scratch scratch;
  receive_lines(chain, context, std::span(&line, 1), scratch);
  CHECK(line.artefacts.has(Artefact::transmit_leakage));
  const std::uint32_t full = chain.recorder().full_scale();
  for (std::size_t i = 0; i < 8; ++i) CHECK(line.bins.sample[i] == full);  // 0.4 m
  for (std::size_t i = 30; i < 190; ++i) CHECK(line.bins.sample[i] < full / 10);
}

TEST_CASE("cross-talk from one side to the other has its level") {
  Sonar sonar = quiet_sonar();
  const SignalChain chain(sonar, {.speckle = false, .arrivals = {.crosstalk_db = -30.0}});
  EchoLine lines[] = {level_line(sonar, port_sector, array, altitude_m),
                      level_line(sonar, starboard_sector, array, altitude_m)};
  std::fill(lines[1].bins.intensity_mean.begin(), lines[1].bins.intensity_mean.end(), 0.0f);
  SignalChain::Scratch scratch;
  receive_lines(chain, context, lines, scratch);
  CHECK(lines[1].artefacts.has(Artefact::crosstalk));
  CHECK(lines[1].bins.intensity[600] == Approx(1e-3 * lines[0].bins.intensity[600]));
  CHECK(lines[0].bins.intensity[600] == Approx(1.0));

  // Without speckle the two sides' energies add, not their amplitudes.
  lines[1] = level_line(sonar, starboard_sector, array, altitude_m);
  receive_lines(chain, context, lines, scratch);
  CHECK(lines[1].bins.intensity[600] == Approx(1.0 + 1e-3));
}

TEST_CASE("a sonar with one side has no cross-talk") {
  Sonar sonar = quiet_sonar();
  sonar.sides = Sides::starboard;
  const SignalChain chain(sonar, {.speckle = false, .arrivals = {.crosstalk_db = -30.0}});
  EchoLine line = level_line(sonar, starboard_sector, array, altitude_m);
  SignalChain::Scratch scratch;
  receive_lines(chain, context, std::span(&line, 1), scratch);
  CHECK_FALSE(line.artefacts.has(Artefact::crosstalk));
}

TEST_CASE("cross-talk brings the other side's surface return, too") {
  Sonar sonar = open_sonar();
  const auto from_surface = [&](std::optional<double> crosstalk_db) {
    const SignalChain chain(
        sonar, {.speckle = false, .arrivals = {.surface = true, .crosstalk_db = crosstalk_db}});
    EchoLine lines[] = {level_line(sonar, port_sector, array, altitude_m),
                        level_line(sonar, starboard_sector, array, altitude_m)};
    for (EchoLine& line : lines) std::ranges::fill(line.bins.intensity_mean, 0.0f);
    SignalChain::Scratch scratch;
    receive_lines(chain, context, lines, scratch);
    return std::ranges::max(lines[1].bins.intensity);
  };
  CHECK(from_surface(-10.0) == Approx(1.1 * from_surface({})));
}
