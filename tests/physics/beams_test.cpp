// Several parallel beams that a side receives from one ping.

#include <algorithm>
#include <cmath>
#include <complex>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "physics/above_bed.h"
#include "support/beds.h"
#include "support/catch.h"

#include <fmt/format.h>

#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/ping_all.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

/// One-way power at a place, summed over an array's elements with their exact distances. The
/// elements are delayed by delay_m(x) of their place x.
template <class F>
double one_way_delayed(double length_m, double along_m, double abeam_m, F&& delay_m) {
  constexpr int elements = 600;
  std::complex<double> sum = 0.0;
  for (int i = 0; i < elements; ++i) {
    const double x_m = length_m * ((i + 0.5) / elements - 0.5);
    sum += std::polar(1.0 / elements, 2.0 * std::numbers::pi / wavelength_m *
                                          (std::hypot(along_m - x_m, abeam_m) - delay_m(x_m)));
  }
  return std::norm(sum);
}

LinePlan starboard_line(int beam) { return {.sector = 1, .beam = beam}; }

/// Starboard lines of a sonar's beams over a level bed that scatters by Lambert's law.
class LambertBed {
 public:
  explicit LambertBed(double altitude_m) : altitude_m_(altitude_m), bed_(level_bed(altitude_m)) {}

  EchoLine line(const Sonar& sonar, int beam, const Pose& pose = {}) const {
    PingTracer pinger(sonar, Medium{1500.0, 0.0}, bed_, lambert_);
    return echo_line(pinger, starboard_line(beam), pose, altitude_m_, {tracer_.get(), bed_.mesh},
                     sonar.bins);
  }

 private:
  double altitude_m_;
  Seafloor bed_;
  std::vector<MaterialInSonar> lambert_ = materials_of(2, scatter::Lambert(-27.0));
  std::unique_ptr<Intersector> tracer_ = make_intersector("embree", bed_.mesh);
};

Sonar five_beams() {
  Sonar sonar = plain_sonar();
  sonar.beams = 5;
  sonar.array_length_m = 0.05;
  sonar.receive_array_length_m = 0.8;
  return sonar;
}

/// Energy of the echo of a small plate, 3 m down for every 4 m abeam, in one beam.
class PlateInBeam {
 public:
  PlateInBeam(const Sonar& sonar, double range_m, double side_m, int beam)
      : sonar_(sonar),
        beam_(beam),
        bed_(level_bed(0.6 * range_m, 0.5 * side_m)),
        altitude_m_(0.6 * range_m) {
    for (Eigen::Vector3f& p : bed_.mesh.positions) p.x() += static_cast<float>(0.8 * range_m);
    pinger_ = std::make_unique<PingTracer>(sonar_, Medium{}, bed_, lambert_);
    tracer_ = make_intersector("embree", bed_.mesh);
  }
  /// With the array's middle at a place along the track.
  double energy(double array_m) {
    const Pose pose{.position = {0.0, array_m + sonar_.beam_offset_m(beam_), 0.0}};
    const EchoLine line = echo_line(*pinger_, starboard_line(beam_), pose, altitude_m_,
                                    {tracer_.get(), bed_.mesh}, sonar_.bins);
    CHECK(line.beam == beam_);
    double sum = 0.0;
    for (const float i : line.bins.intensity_mean) sum += i;
    return sum;
  }

 private:
  const std::vector<MaterialInSonar> lambert_ = materials_of(2, scatter::Lambert(-27.0));
  Sonar sonar_;
  int beam_;
  Seafloor bed_;
  std::unique_ptr<PingTracer> pinger_;
  std::unique_ptr<Intersector> tracer_;
  double altitude_m_;
};

Scene flat_scene() {
  Scene scene;
  scene.texture = false;
  scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = 120.0;
  scene.seafloor.cell_m = 2.0;
  scene.seafloor.depth_m = 20.0;
  scene.seafloor.fractal.height_at_1m_m = 0.0;
  scene.sonars[0].range_m = 50.0;
  scene.sonars[0].bins = 1000;
  scene.sonars[0].array_length_m = 0.05;
  scene.sonars[0].receive_array_length_m = 0.5;
  return scene;
}

/// One ping of five beams over a level bed.
Scene five_beams_without_noise() {
  Scene scene = flat_scene();
  scene.speckle = false;
  scene.track.pings = 1;
  scene.sonars[0].receiver.noise = false;
  scene.sonars[0].beams = 5;
  scene.sonars[0].beam_spacing_m = 0.25;
  return scene;
}

}  // namespace

TEST_CASE(
    "a beam is that of the array's elements, steered and focused to a line parallel to the track") {
  for (const bool zones : {false, true})
    for (const double range_m : {8.0, 14.0, 60.0}) {
      Sonar sonar = five_beams();
      const double zone_m = range_m < 20.0 ? 10.0 : 40.0;
      if (zones) {
        sonar.focused = false;
        sonar.focus_zones_m = {10.0, 40.0};
      }
      sonar.range_m = 1.2 * range_m;
      sonar.bins = 60;
      sonar.sector_low_rad = 0.62;
      sonar.sector_high_rad = 0.667;
      sonar.planes = 1024;
      sonar.elevations = 128;
      const double width_m = std::max(wavelength_m * range_m / 0.8,
                                      zones ? std::abs(1.0 - range_m / zone_m) * 0.8 : 0.0);
      const double side_m = width_m / 6.0;
      // The plate's middle lies `along_m` ahead of the array's.
      const auto expected = [&](int beam, double along_m) {
        const double line_m = sonar.beam_offset_m(beam);
        double sum = 0.0;
        for (int i = 0; i < 8; ++i) {
          const double at_m = along_m + side_m * ((i + 0.5) / 8.0 - 0.5);
          const double sent = one_way_delayed(0.05, at_m, range_m, [](double) { return 0.0; });
          sum += sent * one_way_delayed(0.8, at_m, range_m, [&](double x_m) {
                   return zones ? std::hypot(zone_m, x_m) - zone_m - x_m * line_m / range_m
                                : std::hypot(range_m, x_m - line_m) - std::hypot(range_m, line_m);
                 });
        }
        return sum;
      };
      const double peak = PlateInBeam(sonar, range_m, side_m, 2).energy(0.0) / expected(2, 0.0);
      for (const int beam : {0, 1, 4}) {
        PlateInBeam passing(sonar, range_m, side_m, beam);
        for (const double off : {-0.6, -0.3, 0.0, 0.3, 0.6}) {
          const double along_m = sonar.beam_offset_m(beam) + off * width_m;
          CAPTURE(zones, range_m, beam, off);
          // Near, the approximation of Fresnel is coarser where the array is out of focus.
          const double margin = zones && range_m < 10.0 ? 0.05 : 0.02;
          CHECK(passing.energy(-along_m) / peak ==
                Approx(expected(beam, along_m))
                    .margin(margin * expected(beam, sonar.beam_offset_m(beam))));
        }
      }
    }
}

TEST_CASE("each beam shows the ground abeam of its own part of the array, at all ranges") {
  Scene scene = flat_scene();
  scene.sonars[0].focused = true;
  scene.sonars[0].beams = 5;
  scene.sonars[0].beam_spacing_m = 0.15;
  Simulator simulator(scene);
  const std::span<const EchoLine> lines =
      simulator.ping({.position = {1.0, 2.0, -12.0}, .heading_rad = 0.5});
  REQUIRE(lines.size() == 10);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const EchoLine& line = lines[i];
    CHECK(line.beam == static_cast<int>(i / 2));
    CHECK(line.sector == i % 2);
    for (std::size_t bin = 200; bin < 1000; bin += 100) {
      const double along_m = (double(line.bins.x_m[bin]) - 1.0) * std::sin(0.5) +
                             (double(line.bins.y_m[bin]) - 2.0) * std::cos(0.5);
      CAPTURE(i, bin);
      CHECK(along_m == Approx(0.15 * (line.beam - 2)).margin(0.01));
    }
  }
}

TEST_CASE(
    "an outer beam that lies aside of the transmitter's lobe has the level of both patterns") {
  Sonar sonar = plain_sonar();
  sonar.beams = 3;
  sonar.array_length_m = 0.3;
  const LambertBed bed(10.0);
  for (const double aside_m : {0.15, 0.3, 0.45}) {
    sonar.beam_spacing_m = aside_m;
    const EchoLine middle = bed.line(sonar, 1), outer = bed.line(sonar, 2);
    for (const double range_m : {12.0, 15.0, 20.0, 30.0}) {
      const auto focus_m = [&](double x_m) { return std::hypot(x_m, range_m); };
      const auto at_once = [](double) { return 0.0; };
      const auto width = [&](double offset_m) {
        double sum = 0.0;
        for (double y_m = -0.1 * range_m; y_m < 0.1 * range_m; y_m += 0.002)
          sum += one_way_delayed(0.3, y_m, range_m, at_once) *
                 one_way_delayed(0.3, y_m - offset_m, range_m, focus_m);
        return sum;
      };
      const auto bin = static_cast<std::size_t>(range_m / sonar.bin_m());
      CAPTURE(aside_m, range_m);
      CHECK(scatter::to_db(outer.bins.intensity_mean[bin] / middle.bins.intensity_mean[bin]) ==
            Approx(scatter::to_db(width(aside_m) / width(0.0))).margin(0.15));
    }
  }
}

TEST_CASE("the middle beam is the beam of a sonar without others, and each has noise of its own") {
  Scene scene = flat_scene();
  Simulator single(scene);
  scene.sonars[0].beams = 3;
  Simulator several(scene);
  const Pose pose{.position = {0.0, 0.0, -12.0}};
  const EchoLine alone = single.ping(pose)[1];
  const std::vector<EchoLine> lines = [&] {
    several.ping(pose);
    return several.take_lines();
  }();
  REQUIRE(lines.size() == 6);
  CHECK(lines[3].bins.intensity_mean == alone.bins.intensity_mean);
  CHECK(lines[3].bins.x_m == alone.bins.x_m);
  // In the water column there is noise alone.
  double product = 0.0, one = 0.0, other = 0.0;
  constexpr std::size_t column = 150;
  for (std::size_t bin = 0; bin < column; ++bin) {
    const double a = lines[1].bins.intensity[bin], b = lines[5].bins.intensity[bin];
    REQUIRE(lines[1].bins.intensity_mean[bin] == 0.0f);
    product += a * b;
    one += a;
    other += b;
  }
  CHECK(one > 0.0);
  CHECK(product * column / (one * other) == Approx(1.0).margin(0.3));  // 2 of equal noise
}

TEST_CASE("at as many times the speed, the rows of several beams lie as those of one") {
  Scene scene = flat_scene();
  scene.track.pings = 6;
  scene.track.ping_interval_s = 0.1;
  scene.track.speed_mps = 10.0;
  scene.sonars[0].beams = 5;
  scene.sonars[0].beam_spacing_m = 0.2;
  scene.sonars.push_back(scene.sonars[0]);
  scene.sonars[1].name = "other";
  scene.sonars[1].beams = 1;
  Simulator simulator(scene);
  CHECK(simulator.warnings().empty());
  const ScenePings pings = ping_all(scene, simulator, 2);
  REQUIRE(pings.images.size() == 2);
  const Waterfall& image = pings.images[0];
  REQUIRE(image.rows() == 30);
  CHECK(image.pixels.sample.size() == 30 * image.columns());
  CHECK(pings.images[1].rows() == 6);
  for (std::size_t row = 1; row < image.rows(); ++row) {
    const Eigen::Vector3d step =
        image.pings[row].pose.position - image.pings[row - 1].pose.position;
    CHECK((step - Eigen::Vector3d(0.0, 0.2, 0.0)).norm() < 1e-9);
  }
  const std::size_t far = image.columns() - 1;
  for (std::size_t row = 0; row < image.rows(); ++row) {
    const double y_m = double(image.pixels.y_m[row * image.columns() + far]);
    // The receiver's beam is abeam of the place where the receiver is when the echo returns.
    const double drift_m = 2.0 * 10.0 * 50.0 / simulator.sound_speed_mps();
    CHECK(y_m == Approx(image.pings[row].pose.position.y() + drift_m).margin(0.05));
  }
  // The receiver gets the whole beam there, weighted by the transmit pattern.
  const double sound_speed_mps = simulator.sound_speed_mps();
  const LineArray transmitter{0.05, sound_speed_mps / scene.sonars[0].frequency_hz};
  constexpr std::size_t ping = 3, middle = 2;
  Pose still = image.pings[5 * ping + middle].pose;
  still.velocity_mps.setZero();
  const EchoLine& at_rest = simulator.ping_numbered(still, ping)[2 * middle + 1];
  double moving = 0.0, resting = 0.0;
  for (std::size_t bin = 800; bin < 1000; ++bin) {
    moving +=
        double(image.pixels.intensity_mean[(5 * ping + middle) * image.columns() + 1000 + bin]);
    resting += double(at_rest.bins.intensity_mean[bin]);
  }
  CHECK(moving / resting == Approx(transmitter.power(2.0 * 10.0 / sound_speed_mps)).epsilon(0.02));

  // Warnings: the speed, and a transmitter that does not sound the outer beams.
  scene.track.speed_mps = 12.0;
  scene.sonars[0].array_length_m = 0.5;
  scene.sonars[0].beam_spacing_m = 1.0;
  const Simulator uneven(scene);
  REQUIRE(uneven.warnings().size() == 2);
  CHECK_THAT(uneven.warnings()[0],
             Catch::StartsWith("sonar sidescan: the outermost of its 5 beams ") &&
                 Catch::Contains("-31 dB") && Catch::Contains("at 25 m") &&
                 Catch::Contains("sonar.sidescan.array_length_m"));
  CHECK_THAT(uneven.warnings()[1], Catch::StartsWith("sonar sidescan: its 5 beams cover 5 m ") &&
                                       Catch::Contains("goes 1.2 m") &&
                                       Catch::Contains("the rows overlap") &&
                                       Catch::EndsWith("track.speed_mps = 50"));
}

TEST_CASE("an altitude at which an outer beam lies in a null of the transmitter is warned of") {
  const auto warnings = [](const std::string& altitude_m) {
    const Simulator simulator(parse_scene(
        "version = 1\n[seafloor]\nextent_east_m = 100\nextent_north_m = 20\ncell_m = 1\n"
        "[sonar.k]\npreset = \"klein-5000\"\nrange_m = 50\n[track]\npings = 2\nspeed_mps = 5\n"
        "ping_interval_s = 0.2\naltitude_m = " +
            altitude_m,
        "s.toml"));
    return std::vector<std::string>(simulator.warnings().begin(), simulator.warnings().end());
  };
  const auto weak = [](const std::string& warning) {
    return warning.find(
               "sonar k: the outermost of its 5 beams gets -33 dB of the middle's sound "
               "at 6.69 m: shorten sonar.k.array_length_m, which transmits, or keep an "
               "altitude of 8 m or more") != std::string::npos;
  };
  CHECK(std::ranges::any_of(warnings("6"), weak));
  CHECK(std::ranges::none_of(warnings("8"), [](const std::string& warning) {
    return warning.find("outermost") != std::string::npos;
  }));
}

TEST_CASE("a single beam that passes by most of the echo is warned of, and not one that does not") {
  const auto warned = [](double speed_mps, double length_m, int beams) {
    const Simulator simulator(parse_scene(
        fmt::format("version = 1\nconditions = \"ideal\"\n[seafloor]\nextent_east_m = 100\n"
                    "extent_north_m = 20\ncell_m = 1\n[track]\npings = 2\nspeed_mps = {}\n"
                    "[sonar.s]\nfrequency_hz = 400e3\nfocused = true\nrange_m = 50\nnoise = false\n"
                    "array_length_m = {}\nbeams = {}\n",
                    speed_mps, length_m, beams),
        "s.toml"));
    return std::ranges::count(
        simulator.warnings(),
        fmt::format("sonar s: at {:.3g} m/s its beam has moved on when the echo from 50 m is back, "
                    "and gets less than a tenth of it: go slower, shorten sonar.s.array_length_m, "
                    "or use several beams (sonar.s.beams)",
                    speed_mps));
  };
  // The receiver turns by 2 v / c. What is left of the integral of sinc^4, with the middle lobes.
  const auto left = [](double speed_mps, double length_m) {
    const double shift = 2.0 * speed_mps / 1500.0;
    const auto sinc = [&](double sine) {
      const double x = std::numbers::pi * length_m / wavelength_m * sine;
      return x == 0.0 ? 1.0 : std::sin(x) / x;
    };
    double moved = 0.0, at_rest = 0.0;
    for (double sine = -0.04; sine < 0.04; sine += 1e-5) {
      moved += std::pow(sinc(sine) * sinc(sine - shift), 2);
      at_rest += std::pow(sinc(sine), 4);
    }
    return moved / at_rest;
  };
  for (const double length_m : {0.5, 1.0})
    for (const double speed_mps : {1.0, 1.8, 3.0, 4.5, 12.0}) {
      CAPTURE(length_m, speed_mps, left(speed_mps, length_m));
      CHECK(warned(speed_mps, length_m, 1) == (left(speed_mps, length_m) < 0.1 ? 1 : 0));
    }
  CHECK(warned(12.0, 1.0, 5) == 0);  // outer beams have their own
}

TEST_CASE("the recorder evens out how much sound each beam gets, and the intensity keeps it") {
  Scene scene = five_beams_without_noise();
  Simulator simulator(scene);
  const Waterfall image = ping_all(scene, simulator, 1).images[0];
  const double altitude_m = simulator.altitude_m(image.pings[2].pose.position);
  double max_uneven_db = 0.0, max_db = 0.0;
  for (std::size_t bin = 0; bin < 1000; ++bin) {
    if ((static_cast<double>(bin) + 0.5) * 0.05 < 1.1 * altitude_m) continue;
    const auto relative_db = [&](std::size_t row, const auto& layer) {
      const std::size_t column = 1000 + bin;
      return scatter::to_db(double(layer[row * image.columns() + column]) /
                            double(layer[2 * image.columns() + column]));
    };
    for (const std::size_t row : {0, 1, 3, 4}) {
      max_uneven_db =
          std::max(max_uneven_db, std::abs(2.0 * relative_db(row, image.pixels.sample)));
      max_db = std::max(max_db, -relative_db(row, image.pixels.intensity));
    }
  }
  CAPTURE(altitude_m);
  CHECK(max_uneven_db < 0.3);
  CHECK(max_db > 1.0);
}

TEST_CASE("water and sea surface get as much less sound from outer beams as a level bed does") {
  Scene scene = five_beams_without_noise();
  const auto intensity = [](const Scene& of) {
    Simulator simulator(of);
    return ping_all(of, simulator, 1).images[0].pixels.intensity;
  };
  const std::vector<float> bed = intensity(scene);
  scene.arrivals.volume = true;
  scene.sea.state.volume_scattering_db = -20.0;  // far louder than usual
  const std::vector<float> water = intensity(scene);
  scene.arrivals.volume = false;
  scene.arrivals.surface = true;
  scene.sea.state.wind_mps = 15.0;
  const std::vector<float> surface = intensity(scene);
  constexpr std::size_t columns = 2000, column = 1000 + 500;  // 25 m to starboard
  // What a layer has over the bed, in the rear beam relative to the middle one.
  const auto lost_db = [&](const std::vector<float>& layer, double of_bed = 1.0) {
    const auto more = [&](std::size_t row) {
      const std::size_t pixel = row * columns + column;
      return double(layer[pixel]) - of_bed * double(bed[pixel]);
    };
    REQUIRE(more(2) > 0.001 * double(bed[2 * columns + column]));
    return scatter::to_db(more(0) / more(2));
  };
  REQUIRE(lost_db(bed, 0.0) < -0.3);
  CHECK(lost_db(water) == Approx(lost_db(bed, 0.0)).margin(0.1));
  CHECK(lost_db(surface) == Approx(lost_db(bed, 0.0)).margin(0.1));
}

TEST_CASE("the places of an outer beam are the middle of both patterns, however few the planes") {
  Sonar sonar = plain_sonar();
  sonar.focused = false;
  sonar.beams = 5;
  sonar.beam_spacing_m = 0.2;
  sonar.array_length_m = 0.3;
  sonar.receive_array_length_m = 1.2;
  const LambertBed bed(8.0);
  for (const int planes : {8, 64})
    for (const int beam : {0, 4}) {
      sonar.planes = planes;
      const double offset_m = sonar.beam_offset_m(beam);
      const EchoLine line = bed.line(sonar, beam, {.position = {0.0, offset_m, 0.0}});
      for (const double range_m : {10.0, 15.0, 20.0, 40.0}) {
        const auto at_once = [](double) { return 0.0; };
        double sum = 0.0, moment_m = 0.0;
        for (double y_m = -0.5 * range_m; y_m < 0.5 * range_m; y_m += 0.005) {
          const double power = one_way_delayed(0.3, y_m, range_m, at_once) *
                               one_way_delayed(1.2, y_m - offset_m, range_m, at_once);
          sum += power;
          moment_m += power * y_m;
        }
        CAPTURE(planes, beam, range_m);
        CHECK(double(line.bins.y_m[bin_at(sonar, range_m)]) ==
              Approx(moment_m / sum).margin(0.01));  // side lobes beyond the traced ones: 0.008
      }
    }
}
