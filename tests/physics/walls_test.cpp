// The corner of a wall and the bed.

#include <cmath>
#include <complex>
#include <functional>
#include <numbers>

#include "support/catch.h"
#include "support/lines.h"
#include "support/other_paths.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/forward_lobe.h>
#include <ensonify/scatter/kirchhoff.h>
#include <ensonify/scatter/reflection.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

/// A wall on the bed. Along the track, the middle of the wall is beside_m from the middle of the
/// beam. The normal is turned by turned_rad about the vertical, from the direction to the sonar.
struct Wall {
  double length_m = 40.0, turned_rad = 0.0, beside_m = 0.0, slope = 0.0;
  double away_m = 24.0, height_m = 2.5;
};

/// The facet of a wall on the bed, seen from the array.
WallFacet facet_of(const Wall& wall, double reflected = 1.0) {
  return {.middle = {wall.away_m, wall.beside_m, 0.5 * wall.height_m - altitude_m},
          .normal = {-std::cos(wall.turned_rad), std::sin(wall.turned_rad), 0.0},
          .length_m = wall.length_m,
          .height_m = wall.height_m,
          .reflected = reflected,
          .slope = wall.slope};
}

/// The energy that a wall adds to a bed whose direct echo is 1 in each bin.
double corner_energy(const Sonar& sonar, const Circumstances& under, const Wall& wall,
                     double reflected = 1.0) {
  const SignalChain with(sonar, {.speckle = false,
                                 .nominal_strength = under.strength,
                                 .bed = under.bed,
                                 .arrivals = {.double_bounce = true}});
  EchoLine line = level_line(sonar, starboard_sector, array, altitude_m);
  line.walls = {facet_of(wall, reflected)};
  SignalChain::Scratch scratch;
  receive_lines(with, context, std::span(&line, 1), scratch);
  double added = 0.0;
  for (std::size_t i = 0; i < line.bins.intensity.size(); ++i) {
    const double its = double(line.bins.intensity[i]) - double(line.bins.intensity_mean[i]);
    // The paths are nearly as long as that to the wall's foot.
    const double foot_m = std::hypot(wall.away_m, altitude_m);
    if (std::abs(line.bins.range_m[i] - foot_m) > 0.5) REQUIRE(std::abs(its) < 1e-3);
    added += its;
  }
  return added;
}

/// The same by a sum over the bed. Sound that reaches a place of it over the wall has come from the
/// place's own mirror image behind the wall, if the line there passes through the wall; it has the
/// array's far-field beam in that direction. Each place has two paths, whose amplitudes add. echo:
/// the direct echo of a bin of bed by its range.
template <class Direct, class Bistatic>
double mirrored_energy(
    const Sonar& sonar, const Wall& wall, Direct&& direct, Bistatic&& bistatic,
    const std::function<double(double range_m)>& echo = [](double) { return 1.0; }) {
  const double per_m = sonar.frequency_hz / 1500.0 * sonar.array_length_m;
  const auto beam = [&](double along_m, double range_m) {
    const double a = std::numbers::pi * per_m * along_m / range_m;
    return std::abs(a) < 1e-6 ? 1.0 : std::pow(std::sin(a) / a, 2);
  };
  const Eigen::Vector3d sonar_at(0.0, 0.0, altitude_m);
  const Eigen::Vector3d normal(-std::cos(wall.turned_rad), std::sin(wall.turned_rad), 0.0);
  const Eigen::Vector3d level(std::sin(wall.turned_rad), std::cos(wall.turned_rad), 0.0);
  const Eigen::Vector3d foot(wall.away_m, wall.beside_m, 0.0);
  constexpr double step_m = 0.05, aside_m = 0.01;
  double sum = 0.0;
  for (double x_m = 0.5 * step_m; x_m < wall.away_m + 1.0; x_m += step_m) {
    const double range_m = std::hypot(x_m, altitude_m);
    double across = 0.0;
    for (double y_m = -1.0 + 0.5 * aside_m; y_m < 1.0; y_m += aside_m) {
      const Eigen::Vector3d place(x_m, y_m, 0.0);
      const double before_m = (place - foot).dot(normal);
      if (before_m < 0.0) continue;
      const Eigen::Vector3d image = place - 2.0 * before_m * normal, way = image - sonar_at;
      const Eigen::Vector3d met =
          sonar_at + (foot - sonar_at).dot(normal) / way.dot(normal) * way - foot;
      if (met.z() > wall.height_m || std::abs(met.dot(level)) > 0.5 * wall.length_m) continue;
      const double g_in = std::asin(altitude_m / way.norm()), g = std::asin(altitude_m / range_m);
      // By how much the sound changes its azimuth on the bed.
      const Eigen::Vector3d arrives = way - 2.0 * way.dot(normal) * normal;
      const double turned = std::atan2(arrives.y(), -arrives.x()) - std::atan2(-y_m, x_m);
      across += aside_m * beam(image.y(), way.norm()) * beam(y_m, range_m) *
                bistatic(g_in, g, turned) / direct(g) * std::pow(range_m / way.norm(), 2);
    }
    const double bins = step_m * x_m / range_m / sonar.bin_m();
    sum += 4.0 * echo(range_m) * bins * across / (2.0 / 3.0 * range_m / per_m);
  }
  return sum;
}

double lambert(double sine) { return 3e-4 * sine * sine; }
double mirrored_by_lambert(
    const Sonar& sonar, const Wall& wall,
    const std::function<double(double range_m)>& echo = [](double) { return 1.0; }) {
  return mirrored_energy(
      sonar, wall, [](double g) { return std::pow(std::sin(g), 2.0); },
      [](double a, double b, double) { return std::sin(a) * std::sin(b); }, echo);
}

/// Adds what walls before a bed of that law add to the line.
void receive_over_lambert(const Sonar& sonar, EchoLine& line) {
  const SignalChain chain(
      sonar, {.speckle = false, .nominal_strength = lambert, .arrivals = {.double_bounce = true}});
  SignalChain::Scratch scratch;
  receive_lines(chain, context, std::span(&line, 1), scratch);
}

/// The direct echo of a bin of a level bed by that law. The beam's width grows with the range r,
/// and the bed in a bin is r / x long at the distance x.
double lambert_echo(double range_m) {
  const double over_m = std::sqrt(std::max(std::pow(range_m, 2) - std::pow(altitude_m, 2), 1e-9));
  return 1e6 * lambert(altitude_m / range_m) * std::pow(range_m, -2.0) / over_m;
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

TEST_CASE("the echo of a wall's foot has the shape of the pulse") {
  // All paths have the length of that to the foot within a few bins, and the pulse is much longer.
  Sonar sonar = open_sonar();
  sonar.bins = 6000;
  sonar.pulse.bandwidth_hz = 1e3;
  for (const PulseKind kind : {PulseKind::cw, PulseKind::lfm}) {
    sonar.pulse.kind = kind;
    EchoLine line = level_line(sonar, starboard_sector, array, altitude_m);
    const Wall wall{.height_m = 0.8};
    line.walls = {facet_of(wall)};
    receive_over_lambert(sonar, line);
    const double foot_m = std::hypot(wall.away_m, altitude_m), cell_m = 0.75;
    double energy = 0.0;
    for (std::size_t i = 0; i < line.bins.intensity.size(); ++i)
      energy += double(line.bins.intensity[i]) - double(line.bins.intensity_mean[i]);
    REQUIRE(energy > 0.0);
    for (const double behind_m : {-0.5, -0.3, -0.1, 0.1, 0.2, 0.35, 0.5, 0.65}) {
      const double x = std::numbers::pi * behind_m / cell_m;
      const double expected =
          kind == PulseKind::cw ? double(behind_m > 0.0) : std::pow(std::sin(x) / x, 2);
      const auto bin = static_cast<std::size_t>((foot_m + behind_m) / sonar.bin_m());
      CAPTURE(static_cast<int>(kind), behind_m);
      CHECK((double(line.bins.intensity[bin]) - double(line.bins.intensity_mean[bin])) / energy *
                cell_m / sonar.bin_m() ==
            Approx(expected).margin(0.05));
    }
  }
}

TEST_CASE("a wall that is as near as the bed it mirrors and outshines it mirrors the bed alone") {
  const Sonar sonar = open_sonar();
  for (const Wall& wall :
       {Wall{.away_m = 12.0, .height_m = 5.0}, Wall{.away_m = 14.0, .height_m = 3.0},
        Wall{.away_m = 10.0, .height_m = 4.0}}) {
    EchoLine line = level_line(sonar, starboard_sector, array, altitude_m);
    const double top_m = std::hypot(wall.away_m, altitude_m - wall.height_m),
                 foot_m = std::hypot(wall.away_m, altitude_m);
    for (std::size_t i = 0; i < line.bins.region.size(); ++i) {
      const double range_m = double(line.bins.range_m[i]);
      if (range_m < altitude_m) continue;
      line.bins.intensity_mean[i] = static_cast<float>(lambert_echo(range_m));
      if (range_m < top_m || range_m > foot_m) continue;
      line.bins.intensity_mean[i] *= 10.0f;
      line.bins.region[i] = static_cast<std::uint32_t>(Region::object);
      line.bins.x_m[i] = static_cast<float>(wall.away_m);
    }
    line.walls = {facet_of(wall)};
    receive_over_lambert(sonar, line);
    double added = 0.0;
    for (std::size_t i = 0; i < line.bins.intensity.size(); ++i)
      added += double(line.bins.intensity[i]) - double(line.bins.intensity_mean[i]);
    CAPTURE(wall.away_m, wall.height_m);
    CHECK(scatter::to_db(added / mirrored_by_lambert(sonar, wall, lambert_echo)) ==
          Approx(0.0).margin(0.3));
  }
}

TEST_CASE("a wall mirrors only bed that is seen") {
  const Sonar sonar = open_sonar();
  const double from_m = std::hypot(Wall{}.away_m, altitude_m - Wall{}.height_m) - 9.0,
               foot_m = std::hypot(Wall{}.away_m, altitude_m);
  const auto added = [&](Region region, double over_m, double height_m) {
    EchoLine line = level_line(sonar, starboard_sector, array, altitude_m);
    line.walls = {facet_of({})};
    for (std::size_t i = 0; i < line.bins.region.size(); ++i) {
      const double range_m = double(line.bins.range_m[i]);
      if (range_m > altitude_m)
        line.bins.intensity_mean[i] = static_cast<float>(lambert_echo(range_m));
      if (range_m < from_m || range_m > foot_m) continue;
      line.bins.region[i] = static_cast<std::uint32_t>(region);
      line.bins.x_m[i] = static_cast<float>(array.x() + over_m);
      line.bins.z_m[i] = static_cast<float>(array.z() - altitude_m + height_m);
    }
    receive_over_lambert(sonar, line);
    double sum = 0.0;
    for (std::size_t i = 0; i < line.bins.intensity.size(); ++i)
      sum += double(line.bins.intensity[i]) - double(line.bins.intensity_mean[i]);
    return sum;
  };
  const double whole = added(Region::seabed, 0.0, 0.0);
  CHECK(whole > 1.0);
  // The wall itself is as near as the bed before it; a deck there is nearer than the wall.
  CHECK(added(Region::object, Wall{}.away_m, Wall{}.height_m) == Approx(whole).epsilon(0.02));
  CHECK(added(Region::object, Wall{}.away_m - 6.0, 1.0) < 0.2 * whole);
  CHECK(added(Region::shadow, 0.0, 0.0) < 1e-3 * whole);
}

TEST_CASE("the echo of a high wall that leans is spread over its bins") {
  // The lengths of the wall's paths differ by metres. The echo has no gaps over these ranges.
  const Sonar sonar = open_sonar();
  EchoLine line = level_line(sonar, starboard_sector, array, altitude_m);
  const double leans_rad = 4.0 * degree;
  line.walls = {{.middle = {12.0, 0.0, 2.0 - altitude_m},
                 .normal = {-std::cos(leans_rad), 0.0, std::sin(leans_rad)},
                 .length_m = 40.0,
                 .height_m = 4.0,
                 .reflected = 1.0}};
  receive_over_lambert(sonar, line);
  const auto adds = [&](std::size_t i) {
    return line.bins.intensity[i] > 1.001f * line.bins.intensity_mean[i];
  };
  std::size_t first = 0, last = line.bins.intensity.size() - 1;
  while (first < last && !adds(first)) ++first;
  while (last > first && !adds(last)) --last;
  CAPTURE(first, last);
  REQUIRE(last - first > 32);
  for (std::size_t i = first; i <= last; ++i) CHECK(adds(i));
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
  // A wall that is turned by 45 degrees or more, or that shows its back, mirrors no sound.
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
      const double x_m = Wall{}.away_m - before_m, range_m = std::hypot(x_m, altitude_m);
      const double height_m = altitude_m * before_m / (Wall{}.away_m + before_m);
      if (height_m > Wall{}.height_m) break;
      const double image_m = std::hypot(Wall{}.away_m + before_m, altitude_m);
      const double first_m = image_m * Wall{}.away_m / (Wall{}.away_m + before_m),
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
