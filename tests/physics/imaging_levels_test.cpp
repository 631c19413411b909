// The levels of a sonar that looks ahead, against integrals over what it sees: all beams together,
// a wall and the bed before it at one range, and places to which rays are bent.

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "physics/looks_ahead.h"
#include "support/catch.h"
#include "support/parsed_scene.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;
using scatter::from_db;
using scatter::to_db;

namespace {

constexpr double bed_db = -27.0, wall_db = -45.0;  // Lambert's mu
constexpr double height_m = 3.0;                   // of the sonar over the bed
constexpr double lobes = 4.0;                      // of the pattern to either side of its axis

/// Beams with even steps of the sine, no absorption, and the same level in all depressions.
const std::vector<std::string> plain{"speckle=false",
                                     "sea.absorption_db_per_km=0",
                                     "seafloor.material=bed",
                                     "sonar.ahead.beam_steps=sine",
                                     "sonar.ahead.vertical_beamwidth_deg=0",
                                     "sonar.ahead.elevations=512"};
const std::string materials = fmt::format(R"([material.bed]
model = "lambert"
lambert_mu_db = {}
[material.wall]
model = "lambert"
lambert_mu_db = {}
)",
                                          bed_db, wall_db);

double sinc2(double x) {
  const double angle = std::numbers::pi * x;
  return angle == 0.0 ? 1.0 : std::pow(std::sin(angle) / angle, 2.0);
}

/// The beams of a sonar: what a direction gives to one of them, or to all.
struct Beams {
  const Sonar& sonar;
  double per_sine;  // length of the array in wavelengths

  Beams(const Sonar& of, double sound_speed_mps)
      : sonar(of), per_sine(of.receive_length_m() * of.frequency_hz / sound_speed_mps) {}
  double axis(int beam) const { return std::sin(sonar.bearing_rad(beam)); }
  double of_beam(int beam, double sine) const {
    const double x = per_sine * (sine - axis(beam));
    return std::abs(x) < lobes ? sinc2(x) : 0.0;
  }
  double of_all(double sine) const {
    double sum = 0.0;
    for (int beam = 0; beam < sonar.beams; ++beam) sum += of_beam(beam, sine);
    return sum;
  }
};

/// The transmitter's pattern, whose -3 dB width is the field of view.
double sent(double sine, double field_of_view_rad) {
  return sinc2(0.4429465 * sine / std::sin(0.5 * field_of_view_rad));
}

/// The integral over the sine u, of `power`, of a plane that scatters by Lambert's law and whose
/// perpendicular from the sonar has the length d. A range cell dr of it has the area r^2 dr du /
/// sqrt(r^2 (1 - u^2) - d^2) per du, and the sine of the grazing angle is d / r.
template <class Power>
double plane_integral(double range_m, double away_m, double mu_db, double from, double until,
                      const Power& power) {
  constexpr int steps = 4000;
  const double step = (until - from) / steps;
  double sum = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double u = from + (i + 0.5) * step;
    const double across2 = range_m * range_m * (1.0 - u * u) - away_m * away_m;
    if (across2 > 0.0) sum += power(u) * step / std::sqrt(across2);
  }
  return from_db(mu_db) * away_m * away_m * sum;
}

/// SL - 40 log r of a range cell.
double sent_level(const Sonar& sonar, double range_m, double sound_speed_mps) {
  return from_db(sonar.source_level_db) * sonar.pulse.cell_m(sound_speed_mps) /
         std::pow(range_m, 4.0);
}

double range_of(const Sonar& sonar, std::size_t bin) {
  return (static_cast<double>(bin) + 0.5) * sonar.bin_m();
}

/// The energy of each beam between two ranges.
std::vector<double> energies(const Sonar& sonar, const std::vector<EchoLine>& lines, double from_m,
                             double until_m) {
  std::vector<double> sums;
  for (const EchoLine& line : lines) {
    double sum = 0.0;
    for (std::size_t bin = 0; bin < line.bins.intensity_mean.size(); ++bin)
      if (const double at_m = range_of(sonar, bin); at_m > from_m && at_m < until_m)
        sum += double(line.bins.intensity_mean[bin]);
    sums.push_back(sum);
  }
  return sums;
}

}  // namespace

// Every direction gives each beam its pattern, so all beams together receive the integral over the
// fan of what one element receives, times the sum of their patterns. Where beams lie closer than
// lambda / L, this sum is the same for all directions: the integral of the pattern, over their
// distance (Poisson's sum, because the pattern has no finer structure).
TEST_CASE("the energy of all beams together is the integral over the fan") {
  const int planes = GENERATE(4, 8);
  CAPTURE(planes);
  const Scene scene =
      parsed(level_scene(13.0, fmt::format("planes = {}\n{}", planes, materials)), plain);
  Simulator simulator(scene);
  const auto lines = ping(simulator, over_bed(13.0, height_m));
  const Sonar& sonar = simulator.sonars()[0];
  const Beams beams(sonar, simulator.sound_speed_mps());
  const double between = beams.per_sine * (beams.axis(1) - beams.axis(0));
  double integral = 0.0;
  for (double x = 5e-4; x < lobes; x += 1e-3) integral += 2e-3 * sinc2(x);
  for (const double sine : {0.0, 0.303, -0.71})
    CHECK(beams.of_all(sine) == Approx(integral / between).epsilon(1e-3));

  for (std::size_t bin = 256; bin < 790; bin += 37) {
    const double range_m = range_of(sonar, bin);
    double found = 0.0;
    for (const EchoLine& line : lines) found += double(line.bins.intensity_mean[bin]);
    const double law = sent_level(sonar, range_m, simulator.sound_speed_mps()) *
                       plane_integral(range_m, height_m, bed_db, -1.0, 1.0, [&](double u) {
                         return sent(u, sonar.field_of_view_rad) * beams.of_all(u);
                       });
    CAPTURE(range_m);
    CHECK(std::abs(to_db(found / law)) < 0.02);
  }
}

TEST_CASE("a wall and the bed before it at one range add up in a beam, and the truth says so") {
  constexpr double face_m = 10.0;
  const Scene scene = parsed(level_scene(13.0, materials + fmt::format(R"([[objects]]
shape = "box"
material = "wall"
length_m = 0.5
width_m = 60
tall_m = 4
north_m = {}
)",
                                                                       face_m + 0.25)),
                             plain);
  Simulator simulator(scene);
  const auto lines = ping(simulator, over_bed(13.0, height_m));
  const Sonar& sonar = simulator.sonars()[0];
  const Beams beams(sonar, simulator.sound_speed_mps());
  const double foot_m = std::hypot(face_m, height_m), top_m = std::hypot(face_m, 1.0);
  const BinLayers& middle = lines[128].bins;
  std::size_t both = 0;
  for (std::size_t bin = 256; range_of(sonar, bin) < foot_m - 0.15; ++bin) {
    const double range_m = range_of(sonar, bin);
    if (range_m > face_m - 0.1 && range_m < top_m + 0.05) continue;  // the wall's upper part too
    const auto power = [&](double u) {
      return sent(u, sonar.field_of_view_rad) * beams.of_beam(128, u);
    };
    const double reach = lobes / beams.per_sine;
    const double bed = plane_integral(range_m, height_m, bed_db, -reach, reach, power),
                 wall = plane_integral(range_m, face_m, wall_db, -reach, reach, power);
    const double law = sent_level(sonar, range_m, simulator.sound_speed_mps()) * (bed + wall);
    CAPTURE(range_m, bed, wall);
    CHECK(std::abs(to_db(double(middle.intensity_mean[bin]) / law)) < 0.03);
    CHECK((middle.layover[bin] != 0) == (range_m > face_m));
    if (range_m < face_m) continue;
    CHECK(middle.instance[bin] == (wall > bed ? 1u : 0u));
    CHECK(double(middle.fraction[bin]) == Approx(std::max(wall, bed) / (wall + bed)).margin(0.03));
    ++both;
  }
  CHECK(both >= 5);
}

TEST_CASE(
    "bent rays: a place is at its travel time, and at the bearing at which its sound arrives") {
  // The sound speed falls evenly with depth: rays are arcs of circles about the level at which it
  // would be 0.
  constexpr double surface_mps = 1540.0, gradient = -100.0 / 60.0, bed_m = 60.0;
  constexpr double sonar_m = 10.0, depth_m = 25.0, away_m = 100.0, bearing_rad = 50.0 * degree;
  const auto speed_mps = [](double at_m) { return surface_mps + gradient * at_m; };
  const TemporaryFolder folder;
  std::ofstream(folder / "cast.csv") << "depth_m,soundspeed_mps\n0," << surface_mps << '\n'
                                     << bed_m << ',' << speed_mps(bed_m) << '\n';
  // A glint, an object that rays are too far apart to sample, and one that they do sample.
  const auto [shape, material, size_m] =
      GENERATE(std::tuple("sphere", "steel", 0.4), std::tuple("box", "wall", 0.4),
               std::tuple("box", "wall", 5.0));
  CAPTURE(shape, material, size_m);
  const bool is_box = std::string(shape) == "box";
  // The middle of what is seen: a box's face, or the point of a sphere that is nearest.
  const double middle_m = away_m + 0.5 * size_m;
  Scene scene = parsed(
      level_scene(bed_m, materials + fmt::format(R"([[objects]]
shape = "{}"
material = "{}"
{}
east_m = {}
north_m = {}
heading_deg = 50
height_m = {}
)",
                                                 shape, material,
                                                 is_box ? fmt::format("length_m = {0}\nwidth_m = "
                                                                      "{0}\ntall_m = {0}",
                                                                      size_m)
                                                        : fmt::format("diameter_m = {}", size_m),
                                                 middle_m * std::sin(bearing_rad),
                                                 middle_m * std::cos(bearing_rad),
                                                 bed_m - depth_m - 0.5 * size_m)),
      plain);
  scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = 300.0;
  scene.seafloor.cell_m = 5.0;
  scene.sea.profile = {"cast.csv", folder / "cast.csv"};
  scene.sea.refraction = RefractionMode::full;
  scene.sonars[0].range_m = 120.0;
  scene.sonars[0].bins = 1920;
  scene.sonars[0].planes = 16;  // an edge between two planes is off by up to half their distance
  scene.sonars[0].elevations = 256;
  Simulator simulator(scene);
  const auto lines = ping(simulator, {.position = {0.0, 0.0, -sonar_m}});
  const Sonar& sonar = simulator.sonars()[0];
  const Beams beams(sonar, simulator.sound_speed_mps());

  // With the level of sound speed 0 as origin, the ray's circle has its middle on it; the ray is
  // perpendicular to the radius. Its time is acosh(1 + g^2 s^2 / (2 c c')) / g over the distance s.
  const double from_m = speed_mps(sonar_m) / gradient, to_m = speed_mps(depth_m) / gradient;
  const double circle_m = (away_m * away_m + to_m * to_m - from_m * from_m) / (2.0 * away_m);
  const double launch_rad = std::atan(circle_m / -from_m);  // upwards
  const double time_s =
      std::acosh(1.0 + gradient * gradient * (away_m * away_m + std::pow(depth_m - sonar_m, 2.0)) /
                           (2.0 * speed_mps(sonar_m) * speed_mps(depth_m))) /
      -gradient;
  const double range_m = simulator.sound_speed_mps() * time_s;
  const double sine = std::cos(launch_rad) * std::sin(bearing_rad);
  // A straight ray would arrive a fourth of a beam aside.
  const double straight = std::sin(bearing_rad) * std::cos(std::atan(15.0 / away_m));
  REQUIRE(beams.per_sine * std::abs(sine - straight) > 0.25);

  const std::vector<double> energy = energies(sonar, lines, range_m - 1.0, range_m + 1.0);
  double sum = 0.0, moment = 0.0;
  for (int beam = 0; beam < sonar.beams; ++beam) {
    sum += energy[static_cast<std::size_t>(beam)];
    moment += energy[static_cast<std::size_t>(beam)] * beams.axis(beam);
  }
  REQUIRE(sum > 0.0);
  CHECK(beams.per_sine * (moment / sum - sine) == Approx(0.0).margin(size_m > 1.0 ? 0.06 : 0.03));
  if (size_m > 1.0) return;  // its top is nearer than its middle
  const auto strongest = std::ranges::max_element(energy) - energy.begin();
  const std::vector<float>& levels = lines[static_cast<std::size_t>(strongest)].bins.intensity_mean;
  const auto from = levels.begin() + static_cast<std::ptrdiff_t>((range_m - 1.0) / sonar.bin_m());
  const auto bin = static_cast<std::size_t>(
      std::max_element(from, from + static_cast<std::ptrdiff_t>(2.0 / sonar.bin_m())) -
      levels.begin());
  CHECK(std::abs(range_of(sonar, bin) - range_m) < sonar.bin_m());
}
