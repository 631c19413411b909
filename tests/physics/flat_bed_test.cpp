#include <algorithm>
#include <cmath>
#include <numbers>

#include "physics/above_bed.h"
#include "support/beds.h"
#include "support/catch.h"

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

// The sonar equation for a flat bed under a line array, dB; the beam is 2/3 lambda/L wide along the
// track.
double closed_form_db(const Sonar& sonar, const Medium& medium, double r,
                      const scatter::Backscatter& bed = scatter::Lambert(-27.0),
                      double to_bed_m = altitude_m) {
  const double grazing = std::asin(to_bed_m / r);
  const double wavelength_m = medium.sound_speed_mps / sonar.frequency_hz;
  const double width_rad = 2.0 / 3.0 * wavelength_m / sonar.array_length_m;
  const double cell_m = sonar.pulse.cell_m(medium.sound_speed_mps);
  const double area_m2 = r * width_rad * cell_m / std::cos(grazing);
  return sonar.source_level_db - 40.0 * std::log10(r) - 2.0 * medium.absorption_db_per_m * r +
         scatter::to_db(bed.cross_section(grazing)) + 10.0 * std::log10(area_m2);
}

/// The middle of the range cell that a bin receives.
double cell_middle_m(const Sonar& sonar, const Medium& medium, double range_m) {
  return range_m - (sonar.pulse.kind == PulseKind::cw
                        ? 0.5 * sonar.pulse.cell_m(medium.sound_speed_mps)
                        : 0.0);
}

double worst_error_db(const Sonar& sonar, const Medium& medium, const EchoLine& line,
                      double from_m) {
  double worst = 0.0;
  for (std::size_t i = 0; i < line.bins.range_m.size(); ++i) {
    if (line.bins.range_m[i] < from_m) continue;
    const double r = cell_middle_m(sonar, medium, line.bins.range_m[i]);
    const double level = scatter::to_db(line.bins.intensity_mean[i]);
    worst = std::max(worst, std::abs(level - closed_form_db(sonar, medium, r)));
  }
  return worst;
}

/// Medium sand without relief at 20 m, under a sonar of 100 kHz.
Scene flat_sand() {
  Scene scene;
  scene.seafloor.fractal.height_at_1m_m = 0.0;
  scene.seafloor.depth_m = 20.0;
  scene.seafloor.material = "medium sand";
  scene.sea.sound_speed_mps = 1528.0;
  scene.sea.absorption_db_per_km = 30.0;
  scene.sonars.front() = plain_sonar();
  scene.sonars.front().frequency_hz = 100e3;
  return scene;
}

}  // namespace

TEST_CASE("a flat bed's level follows the sonar equation within 0.05 dB from 1.05 heights on") {
  const Medium medium{1500.0, 0.03};
  for (const double frequency_hz : {100e3, 400e3, 900e3}) {
    Sonar sonar = plain_sonar();
    sonar.frequency_hz = frequency_hz;
    const auto lines = ping_once(sonar, level_bed(20.0), above_bed, altitude_m, medium);
    for (const EchoLine& line : lines) {
      CAPTURE(frequency_hz, line.sector);
      CHECK(worst_error_db(sonar, medium, line, 1.05 * altitude_m) < 0.05);
      CHECK(worst_error_db(sonar, medium, line, 1.2 * altitude_m) < 0.03);
    }
  }
}

TEST_CASE("a flat bed's level follows the sonar equation whatever the pulse and its sampling") {
  const Medium medium{1500.0, 0.03};
  for (const PulseWindow window : {PulseWindow::none, PulseWindow::hann})
    for (const double sample_rate_hz : {0.0, 40e3, 200e3}) {
      Sonar sonar = plain_sonar();
      sonar.pulse.kind = PulseKind::lfm;
      sonar.pulse.window = window;
      sonar.sample_rate_hz = sample_rate_hz;
      sonar = sonar.sampled(medium.sound_speed_mps);
      const auto lines = ping_once(sonar, level_bed(20.0), above_bed, altitude_m, medium);
      CAPTURE(static_cast<int>(window), sample_rate_hz);
      CHECK(worst_error_db(sonar, medium, lines[1], 1.25 * altitude_m) < 0.05);
    }
}

TEST_CASE("a flat bed's level follows the sonar equation with the equivalent beam of any shading") {
  const Medium medium{1500.0, 0.03};
  struct Arrays {
    ShadingKind transmit, receive;
    double receive_m;
    int side_lobes;
  };
  for (const Arrays& arrays : {Arrays{ShadingKind::hann, ShadingKind::same, 0.0, 0},
                               Arrays{ShadingKind::taylor, ShadingKind::same, 0.0, 0},
                               Arrays{ShadingKind::chebyshev, ShadingKind::same, 0.0, 3},
                               Arrays{ShadingKind::weights, ShadingKind::same, 0.0, 0},
                               Arrays{ShadingKind::uniform, ShadingKind::hann, 0.0, 3},
                               Arrays{ShadingKind::taylor, ShadingKind::uniform, 0.4, 4}}) {
    Sonar sonar = plain_sonar();
    sonar.shading = arrays.transmit;
    sonar.receive_shading = arrays.receive;
    sonar.receive_array_length_m = arrays.receive_m;
    sonar.side_lobes = arrays.side_lobes;
    if (arrays.transmit == ShadingKind::weights) sonar.shading_weights = {1, 3, 5, 6, 5, 3, 1};
    const double wavelength_m = 1500.0 / sonar.frequency_hz;
    const LineArray transmit = sonar.transmit_array(wavelength_m);
    const LineArray receive = sonar.receive_array(wavelength_m);
    double width_rad = 0.0;
    for (double s = 1e-6; s < 0.4; s += 2e-6)
      width_rad += 2.0 * 2e-6 * transmit.power(s) * receive.power(s);
    const double change_db =
        scatter::to_db(width_rad / (2.0 / 3.0 * wavelength_m / sonar.array_length_m));
    const auto lines = ping_once(sonar, level_bed(20.0), above_bed, altitude_m, medium);
    for (std::size_t i = 0; i < lines[1].bins.range_m.size(); ++i) {
      const double r = lines[1].bins.range_m[i];
      if (r < 1.2 * altitude_m) continue;
      CAPTURE(static_cast<int>(arrays.transmit), static_cast<int>(arrays.receive), r, change_db);
      REQUIRE(scatter::to_db(lines[1].bins.intensity_mean[i]) ==
              Approx(closed_form_db(sonar, medium, r) + change_db).epsilon(0).margin(0.05));
    }
  }
}

TEST_CASE("a tone of 1 ms over a flat bed begins at the altitude and has the level of its cell") {
  const Medium medium{1500.0, 0.03};
  Sonar sonar = plain_sonar();
  sonar.pulse.length_s = 1e-3;
  const double cell_m = 0.75;
  const auto line = ping_once(sonar, level_bed(20.0), above_bed, altitude_m, medium)[1];
  for (std::size_t i = 0; i < line.bins.range_m.size(); ++i) {
    const double r = line.bins.range_m[i];
    CAPTURE(r);
    if (r < altitude_m - sonar.bin_m()) REQUIRE(line.bins.intensity_mean[i] == 0.0f);
    if (r > altitude_m + sonar.bin_m()) REQUIRE(line.bins.intensity_mean[i] > 0.0f);
    if (r < altitude_m + cell_m + 0.3) continue;
    // The sonar equation for the places between r - cell and r, each with its own range.
    double sum = 0.0;
    constexpr int parts = 200;
    for (int k = 0; k < parts; ++k)
      sum +=
          scatter::from_db(closed_form_db(sonar, medium, r - cell_m * (k + 0.5) / parts)) / parts;
    REQUIRE(scatter::to_db(line.bins.intensity_mean[i]) ==
            Approx(scatter::to_db(sum)).epsilon(0).margin(0.03));
  }
}

TEST_CASE("a flat bed shows the measured vertical pattern twice (in dB), each side its own") {
  const Medium medium{1500.0, 0.0};
  Sonar sonar = plain_sonar();
  // A dark band at 30 degrees; a bin at its edge contains levels of both sides of the edge.
  const std::vector<double> corners = {0.35, 0.52, 0.7};
  sonar.vertical.measured = {
      std::vector<VerticalLevel>{{0.0, -3.0}, {0.35, -1.0}, {0.52, -9.0}, {0.7, 0.0}, {1.5, -14.0}},
      std::vector<VerticalLevel>{{-0.5, 0.0}, {1.5, -20.0}}};
  const auto lines = ping_once(sonar, level_bed(20.0), above_bed, altitude_m, medium);
  for (const EchoLine& line : lines)
    for (std::size_t i = 0; i < line.bins.range_m.size(); ++i) {
      const double r = cell_middle_m(sonar, medium, line.bins.range_m[i]);
      if (r < 1.2 * altitude_m) continue;
      const double depression = std::asin(altitude_m / r);
      if (std::ranges::any_of(corners, [&](double c) { return std::abs(depression - c) < 0.005; }))
        continue;
      const double level_db =
          scatter::to_db(line.bins.intensity_mean[i]) -
          2.0 * scatter::to_db(sonar.vertical.power(depression, sidescan_sectors[line.sector]));
      CAPTURE(line.sector, r);
      REQUIRE(level_db == Approx(closed_form_db(sonar, medium, r)).epsilon(0).margin(0.05));
    }
}

TEST_CASE("each side hears the whole bed about the nearest place, level or turned by 10 degrees") {
  const Medium medium{1500.0, 0.0};
  for (const double beamwidth_deg : {50.0, 60.0, 0.0})
    for (const double slope_deg : {-10.0, -5.0, 0.0, 5.0, 10.0}) {  // down to starboard
      Sonar sonar = plain_sonar();
      sonar.sector_high_rad.reset();
      sonar.vertical.beamwidth_rad = beamwidth_deg * degree;
      const double slope = slope_deg * degree, to_bed_m = altitude_m * std::cos(slope);
      Seafloor bed = level_bed(20.0, 200.0);
      for (Eigen::Vector3f& p : bed.mesh.positions)
        p.z() -= static_cast<float>(std::tan(slope)) * p.x();
      for (const EchoLine& line : ping_once(sonar, bed, above_bed, altitude_m, medium)) {
        const double down = line.sector == 1 ? slope : -slope;
        CAPTURE(beamwidth_deg, slope_deg, line.sector);
        CHECK(std::abs(line.first_return * sonar.bin_m() - to_bed_m) < 2.0 * sonar.bin_m());
        for (std::size_t i = 0; i < line.bins.range_m.size(); ++i) {
          const double r = cell_middle_m(sonar, medium, line.bins.range_m[i]);
          if (r < 1.05 * to_bed_m || r > 4.0 * to_bed_m) continue;
          // Two places have this range. The side receives an echo from each of them.
          const double off = std::acos(to_bed_m / r), foot = std::numbers::pi / 2.0 + down;
          // Without a vertical pattern the fan ends at 135 degrees.
          if (beamwidth_deg == 0.0 && foot + off > 133.0 * degree) break;
          const double here = sonar.vertical.power(foot - off, sidescan_sectors[line.sector]),
                       there = sonar.vertical.power(foot + off, sidescan_sectors[line.sector]);
          CAPTURE(r, off / degree);
          REQUIRE(scatter::to_db(line.bins.intensity_mean[i]) ==
                  Approx(closed_form_db(sonar, medium, r, scatter::Lambert(-27.0), to_bed_m) +
                         scatter::to_db(here * here + there * there))
                      .epsilon(0)
                      .margin(0.13));
        }
      }
    }
}

TEST_CASE("where a side hears both sides of nadir, places are on its own, at the bin's range") {
  const Medium medium{1500.0, 0.0};
  for (const double beamwidth_deg : {50.0, 0.0}) {
    Sonar sonar = plain_sonar();
    sonar.sector_high_rad.reset();
    sonar.vertical.beamwidth_rad = beamwidth_deg * degree;
    for (const EchoLine& line : ping_once(sonar, level_bed(20.0), above_bed, altitude_m, medium)) {
      CAPTURE(beamwidth_deg, line.sector);
      CHECK(line.starved == 0);
      for (std::size_t i = 0; i < line.bins.range_m.size(); ++i) {
        const double r = line.bins.range_m[i];
        if (r < 1.01 * altitude_m) continue;  // a bin spans many places
        const double out_m = std::sqrt(r * r - altitude_m * altitude_m);
        CAPTURE(r);
        REQUIRE(double(line.bins.x_m[i]) ==
                Approx(line.sector == 0 ? -out_m : out_m).epsilon(0).margin(0.1));
        REQUIRE(line.bins.grazing_rad[i] == Approx(std::asin(altitude_m / r)).margin(0.01));
        REQUIRE(line.bins.layover[i] == 0);
      }
    }
  }
}

TEST_CASE("a flat bed's image has no ring, and no stripe where the fan's layout changes") {
  Sonar sonar;  // with its near field and its vertical pattern
  std::vector<float> before;
  // Layouts change at altitudes of 2^(n / 4); one of these, 8, lies between the second and the
  // third.
  for (const double height_m : {7.9998, 7.9999, 8.0001, 8.0002, 9.5135, 9.5139}) {
    const auto line =
        ping_once(sonar, level_bed(20.0), {.position = {0.0, 0.0, height_m - 20.0}}, height_m)[1];
    const std::vector<float>& mean = line.bins.intensity_mean;
    const auto from = static_cast<std::size_t>(1.2 * height_m / sonar.bin_m());
    double roughness = 0.0;
    for (std::size_t i = from; i + 1 < mean.size(); ++i)
      roughness = std::max(
          roughness, std::abs(scatter::to_db(mean[i] * mean[i] / (mean[i - 1] * mean[i + 1]))));
    CAPTURE(height_m);
    CHECK(roughness < 0.015);
    if (!before.empty() && height_m != 9.5135)
      for (std::size_t i = from; i < mean.size(); ++i)
        REQUIRE(std::abs(scatter::to_db(mean[i] / before[i])) < 0.03);
    before = mean;
  }
}

TEST_CASE("a flat bed of many facets has uniform columns at every altitude") {
  for (const double height_m : {4.0, 11.0, 19.0}) {
    Scene scene;
    scene.seafloor.fractal.height_at_1m_m = 0.0;
    scene.seafloor.depth_m = 30.0;
    scene.seafloor.cell_m = 0.37;
    scene.seafloor.extent_east_m = 120.0;
    scene.seafloor.extent_north_m = 40.0;
    scene.sonars.front().range_m = 50.0;
    scene.sonars.front().bins = 500;
    scene.speckle = false;
    Simulator simulator(scene);
    Pose pose{.position = {0.0, 0.0, height_m - 30.0}};
    std::vector<double> lowest(500, 1e9), highest(500, -1e9);
    for (std::uint64_t ping = 0; ping < 12; ++ping) {
      pose.position.y() = 0.133 * static_cast<double>(ping);
      const EchoLine& line = simulator.ping_numbered(pose, ping)[1];
      for (std::size_t i = 0; i < 500; ++i) {
        const double level = scatter::to_db(std::max(line.bins.intensity_mean[i], 1e-30f));
        lowest[i] = std::min(lowest[i], level);
        highest[i] = std::max(highest[i], level);
      }
    }
    CAPTURE(height_m);
    for (auto i = static_cast<std::size_t>(1.05 * height_m / 0.1); i < 500; ++i)
      REQUIRE(highest[i] - lowest[i] < 0.004);
  }
}

TEST_CASE(
    "a flat bed of medium sand has the level of the sonar equation with the model's strength") {
  const Scene scene = flat_sand();
  const Sonar& sonar = scene.sonars.front();
  Simulator simulator(scene);
  CHECK(simulator.warnings().empty());
  const Medium medium{1528.0, 0.03};
  const scatter::Bottom sand(scatter::sediment_named("medium sand"), 100e3, 1528.0);
  for (const EchoLine& line : simulator.ping_numbered(above_bed, 0))
    for (std::size_t i = 0; i < line.bins.range_m.size(); ++i) {
      const double r = line.bins.range_m[i];
      if (r < 1.2 * altitude_m) continue;
      CAPTURE(r, line.sector);
      REQUIRE(scatter::to_db(line.bins.intensity_mean[i]) ==
              Approx(closed_form_db(sonar, medium, r, sand)).epsilon(0).margin(0.05));
    }
}

TEST_CASE("a bed that slopes across the track has levels and angles of a level one as far away") {
  Scene scene = flat_sand();
  scene.seafloor.slope_rad = 0.15;
  scene.seafloor.downhill_rad = 0.5 * std::numbers::pi;  // to starboard
  const Sonar& sonar = scene.sonars.front();
  Simulator simulator(scene);
  const double to_bed_m = altitude_m * std::cos(0.15);  // to the nearest point, which is to port
  const Medium medium{1528.0, 0.03};
  const scatter::Bottom sand(scatter::sediment_named("medium sand"), 100e3, 1528.0);
  for (const EchoLine& line : simulator.ping_numbered(above_bed, 0)) {
    const double first_m = line.sector == 0 ? to_bed_m : altitude_m;
    CAPTURE(line.sector);
    CHECK(std::abs(line.first_return * sonar.bin_m() - first_m) < 2.0 * sonar.bin_m());
    for (std::size_t i = 0; i < line.bins.range_m.size(); ++i) {
      const double r = line.bins.range_m[i];
      if (r < 1.2 * altitude_m) continue;
      CAPTURE(r);
      REQUIRE(scatter::to_db(line.bins.intensity_mean[i]) ==
              Approx(closed_form_db(sonar, medium, r, sand, to_bed_m)).epsilon(0).margin(0.05));
      REQUIRE(line.bins.grazing_rad[i] == Approx(std::asin(to_bed_m / r)).margin(0.002));
    }
  }
}

TEST_CASE(
    "the first return of a bed like a mirror has its lobe's energy, with few planes or many") {
  // The lobe is far narrower than the rays are apart. The planes of the shorter array are up to 2
  // degrees apart.
  constexpr double pi = std::numbers::pi, range_m = 1.03 * altitude_m;
  Scene scene;
  scene.texture = scene.speckle = false;
  scene.seafloor.fractal.height_at_1m_m = 0.0;
  scene.seafloor.depth_m = 20.0;
  scene.materials = {{.name = "smooth mud", .like = "silt", .exponent = 2.6, .strength_cm4 = 1e-5}};
  scene.seafloor.material = "smooth mud";
  scene.sea.sound_speed_mps = 1500.0;
  scene.sea.absorption_db_per_km = 0.0;
  scatter::Sediment mud = scatter::sediment_named("silt");
  mud.exponent = 2.6;
  mud.strength_cm4 = 1e-5;
  const scatter::Bottom bed(mud, 100e3, 1500.0);
  for (const double array_m : {plain_sonar().array_length_m, 0.1}) {
    Sonar sonar = plain_sonar();
    sonar.frequency_hz = 100e3;
    sonar.array_length_m = array_m;
    const LineArray array = sonar.transmit_array(0.015);
    // The echo of one side of the bed up to that range, over the logarithm of the distance from the
    // point below the sonar, and over the angle from the track.
    double exact = 0.0;
    constexpr double step = 0.03;
    constexpr int turns = 2000;
    for (double over_m = std::sqrt(range_m * range_m - altitude_m * altitude_m) * 0.985;
         over_m > 1e-13; over_m *= 1.0 - step) {
      const double r = std::hypot(over_m, altitude_m);
      double beam = 0.0;
      for (int i = 0; i < turns; ++i) {
        const double sine = over_m / r * std::cos(pi * (i + 0.5) / turns);
        if (std::abs(sine) < std::sin(array.null_rad(1))) beam += std::pow(array.power(sine), 2.0);
      }
      exact += beam * pi / turns * over_m * over_m * -std::log1p(-step) * std::pow(r, -4.0) *
               bed.cross_section(std::atan2(altitude_m, over_m));
    }
    exact *= scatter::from_db(sonar.source_level_db) * sonar.pulse.cell_m(1500.0);
    for (const int planes : {8, 16, 64}) {
      sonar.planes = planes;
      scene.sonars.front() = sonar;
      Simulator simulator(scene);
      for (const EchoLine& line : simulator.ping_numbered(above_bed, 0)) {
        double sum = 0.0;  // of intensity over range
        for (std::size_t i = 0; i < line.bins.range_m.size(); ++i)
          if (line.bins.range_m[i] < range_m)
            sum += sonar.bin_m() * double(line.bins.intensity_mean[i]);
        CAPTURE(array_m, planes, line.sector);
        CHECK(std::abs(scatter::to_db(sum / exact)) < 1.5);
      }
    }
  }
}

TEST_CASE("the level does not depend on the number of planes, elevations or bins") {
  const Medium medium{1500.0, 0.03};
  for (const int planes : {8, 16, 32})
    for (const int elevations : {1500, 3000})
      for (const int bins : {300, 1500, 6000}) {
        Sonar sonar = plain_sonar();
        sonar.planes = planes;
        sonar.elevations = elevations;
        sonar.bins = bins;
        const auto lines = ping_once(sonar, level_bed(20.0), above_bed, altitude_m, medium);
        CAPTURE(planes, elevations, bins);
        CHECK(worst_error_db(sonar, medium, lines[1], 1.25 * altitude_m) < 0.05);
      }
}

TEST_CASE("twice the planes, elevations or bins change the level by less than 0.02 dB") {
  for (const bool focused : {true, false}) {
    Sonar sonar = plain_sonar();
    sonar.focused = focused;
    const auto once = ping_once(sonar, level_bed(20.0), above_bed, altitude_m)[1];
    for (const int what : {0, 1, 2}) {
      Sonar doubled = sonar;
      (what == 0 ? doubled.planes : what == 1 ? doubled.elevations : doubled.bins) *= 2;
      const auto twice = ping_once(doubled, level_bed(20.0), above_bed, altitude_m)[1];
      double worst = 0.0;
      for (auto i = static_cast<std::size_t>(1.2 * altitude_m / sonar.bin_m());
           i < static_cast<std::size_t>(sonar.bins); ++i) {
        const double there =
            what == 2
                ? 0.5 * (twice.bins.intensity_mean[2 * i] + twice.bins.intensity_mean[2 * i + 1])
                : twice.bins.intensity_mean[i];
        worst = std::max(worst, std::abs(scatter::to_db(there / once.bins.intensity_mean[i])));
      }
      CAPTURE(focused, what);
      CHECK(worst < 0.02);
    }
  }
}

TEST_CASE("32 elevations light a level bed, 64 give its energy at 37 heights") {
  // Cells of 20 cm, over which the rays step.
  Seafloor bed;
  constexpr int columns = 1000, rows = 20;
  constexpr float cell_m = 0.2f;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i <= columns; ++i)
      bed.mesh.positions.emplace_back((i - 0.5f * columns) * cell_m, (j - 0.5f * rows) * cell_m,
                                      -20.0f);
  for (std::uint32_t j = 0; j < rows; ++j)
    for (std::uint32_t i = 0; i < columns; ++i) {
      const std::uint32_t a = j * (columns + 1) + i, b = a + columns + 1;
      bed.mesh.faces.push_back({a, a + 1, b + 1});
      bed.mesh.faces.push_back({a, b + 1, b});
    }
  bed.bed_faces = static_cast<std::uint32_t>(bed.mesh.faces.size());
  bed.labels = {{1, 1, 0}};
  for (const double height_m : {2.0, 10.0, 30.0})
    for (const int elevations : {32, 64}) {
      Sonar sonar = plain_sonar();
      sonar.elevations = elevations;
      const auto lines = ping_once(sonar, bed, {.position = {0.0, 0.0, height_m - 20.0}}, height_m);
      sonar.elevations = 4096;
      const auto fine =
          ping_once(sonar, level_bed(20.0), {.position = {0.0, 0.0, height_m - 20.0}}, height_m);
      double energy = 0.0, its_energy = 0.0, dark = 0.0;
      for (std::size_t i = 0; i < lines[1].bins.region.size(); ++i) {
        const double r = double(fine[1].bins.range_m[i]);
        if (r < 1.2 * height_m) continue;
        energy += r * r * r * double(lines[1].bins.intensity_mean[i]);
        its_energy += r * r * r * double(fine[1].bins.intensity_mean[i]);
        dark += lines[1].bins.region[i] == static_cast<std::uint32_t>(Region::shadow);
      }
      CAPTURE(height_m, elevations);
      CHECK(dark == 0.0);
      CHECK(scatter::to_db(energy / its_energy) ==
            Approx(0.0).margin(elevations == 32 ? 0.3 : 0.03));
    }
}

TEST_CASE("port and starboard of a level sonar over a level bed are equal") {
  const auto lines = ping_once(plain_sonar(), level_bed(20.0), above_bed, altitude_m);
  for (std::size_t i = 0; i < lines[0].bins.intensity_mean.size(); ++i)
    REQUIRE(lines[0].bins.intensity_mean[i] ==
            Approx(lines[1].bins.intensity_mean[i]).epsilon(1e-4).margin(1e-6));
}

TEST_CASE("the first return lies at the altitude, and the water before it is dark") {
  const Sonar sonar = plain_sonar();
  const auto lines = ping_once(sonar, level_bed(20.0), above_bed, altitude_m);
  for (const EchoLine& line : lines) {
    const auto first = static_cast<std::size_t>(line.first_return);
    CHECK(std::abs(line.bins.range_m[first] - altitude_m) <= sonar.bin_m());
    CHECK(line.starved == 0);
    for (std::size_t i = 0; i < line.bins.region.size(); ++i)
      REQUIRE(line.bins.region[i] ==
              static_cast<std::uint32_t>(i < first ? Region::water_column : Region::seabed));
    for (std::size_t i = 0; i + 2 < first; ++i) REQUIRE(line.bins.intensity_mean[i] == 0.0f);
  }
}

TEST_CASE("a flat bed's truth is its geometry: place, grazing angle, no shadow, no layover") {
  const Sonar sonar = plain_sonar();
  Pose pose = above_bed;
  pose.heading_rad = 0.5;
  const auto lines = ping_once(sonar, level_bed(20.0), pose, altitude_m);
  const Eigen::Matrix3d body = body_to_world(pose);
  for (const EchoLine& line : lines) {
    const double sign = line.sector == 0 ? -1.0 : 1.0;
    for (std::size_t i = 0; i < line.bins.range_m.size(); ++i) {
      const double r = line.bins.range_m[i];
      if (r < 1.05 * altitude_m) continue;
      CAPTURE(r);
      const Eigen::Vector3d expected =
          pose.position + sign * std::sqrt(r * r - altitude_m * altitude_m) * body.col(1) +
          altitude_m * body.col(2);
      const Eigen::Vector3d place{line.bins.x_m[i], line.bins.y_m[i], line.bins.z_m[i]};
      REQUIRE((place - expected).norm() < 0.1);
      REQUIRE(line.bins.grazing_rad[i] == Approx(std::asin(altitude_m / r)).margin(2e-3));
      REQUIRE(line.bins.shadow_fraction[i] == 0.0f);
      REQUIRE(line.bins.layover[i] == 0);
      REQUIRE(line.bins.sediment[i] == 1);
      REQUIRE(line.bins.fraction[i] == 1.0f);
    }
  }
}

TEST_CASE("a flat bed of cells far smaller than the rays' steps has no gap, and shadows stay") {
  // A strip as wide as the beam, of 5 cm cells. 200 rays meet it half a metre and more apart.
  constexpr float cell_m = 0.05f, half_m = 0.6f, reach_m = 80.0f;
  Seafloor bed = level_bed(20.0, half_m);
  bed.mesh.positions.clear();
  bed.mesh.faces.clear();
  const auto rows = static_cast<std::uint32_t>(2 * half_m / cell_m) + 1;
  const auto columns = static_cast<std::uint32_t>(2 * reach_m / cell_m) + 1;
  for (std::uint32_t i = 0; i < columns; ++i)
    for (std::uint32_t j = 0; j < rows; ++j) {
      bed.mesh.positions.emplace_back(static_cast<float>(i) * cell_m - reach_m,
                                      static_cast<float>(j) * cell_m - half_m, -20.0f);
      if (i == 0 || j == 0) continue;
      const std::uint32_t here = i * rows + j, left = here - rows;
      bed.mesh.faces.push_back({left - 1, here - 1, here});
      bed.mesh.faces.push_back({left - 1, here, left});
    }
  bed.bed_faces = bed.mesh.faces.size();
  Sonar sonar = plain_sonar();
  sonar.elevations = 200;
  for (const EchoLine& line : ping_once(sonar, bed, above_bed, altitude_m)) {
    CHECK(line.starved == 0);
    for (std::size_t i = bin_at(sonar, altitude_m) + 1; i < line.bins.region.size(); ++i)
      REQUIRE(line.bins.region[i] == static_cast<std::uint32_t>(Region::seabed));
    CHECK(worst_error_db(sonar, {}, line, 2.0 * altitude_m) < 0.05);
  }
  add_box(bed, {30.0f, -0.6f, -20.0f}, {30.1f, 0.6f, -18.0f});
  const EchoLine line = ping_once(sonar, bed, above_bed, altitude_m)[1];
  const double end_m = std::hypot(30.1 * altitude_m / (altitude_m - 2.0), altitude_m);
  constexpr double step_m = 0.8;
  for (double r = std::hypot(30.0, altitude_m) + step_m; r < end_m - step_m; r += sonar.bin_m()) {
    REQUIRE(line.bins.region[bin_at(sonar, r)] == static_cast<std::uint32_t>(Region::shadow));
    REQUIRE(line.bins.intensity_mean[bin_at(sonar, r)] == 0.0f);
  }
  CHECK(line.bins.region[bin_at(sonar, end_m + step_m)] ==
        static_cast<std::uint32_t>(Region::seabed));
}

TEST_CASE("a bed that rises to the side is uniform up to the last bin: no hole, no rim") {
  // Up to a quarter of the altitude (0.09) there are rays spaced evenly in range; beyond, only
  // rays spaced evenly in angle.
  for (const auto& [rise, largest_step_db] : {std::pair{0.05, 0.1}, {0.09, 0.1}, {0.12, 1.0}}) {
    CAPTURE(rise);
    Seafloor bed = level_bed(20.0, 100.0);
    for (Eigen::Vector3f& p : bed.mesh.positions) p.z() += static_cast<float>(rise) * p.x();
    Sonar sonar = plain_sonar();
    sonar.elevations = 1000;
    const EchoLine starboard = ping_once(sonar, bed, above_bed, altitude_m)[1];
    CHECK(starboard.starved == 0);
    const std::vector<float>& mean = starboard.bins.intensity_mean;
    for (std::size_t i = mean.size() / 3; i < mean.size(); ++i) {
      REQUIRE(starboard.bins.region[i] == static_cast<std::uint32_t>(Region::seabed));
      REQUIRE(std::abs(scatter::to_db(mean[i] / mean[i - 1])) < largest_step_db);
    }
  }
}

TEST_CASE("the image's energy does not depend on which intersector found the hits") {
  Sonar sonar = plain_sonar();
  Seafloor bed = level_bed(20.0);
  add_box(bed, {20.0f, -5.0f, -20.0f}, {22.0f, 5.0f, -17.0f});
  const auto a = ping_once(sonar, bed, above_bed, altitude_m, {}, "embree");
  const auto b = ping_once(sonar, bed, above_bed, altitude_m, {}, "brute_force");
  for (std::size_t i = 0; i < a[1].bins.intensity_mean.size(); ++i)
    REQUIRE(a[1].bins.intensity_mean[i] ==
            Approx(b[1].bins.intensity_mean[i]).epsilon(2e-3).margin(1e-3));
}
