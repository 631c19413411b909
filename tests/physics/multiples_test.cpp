// Times and levels of multiples by the surface and the bed.

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
#include "support/other_paths.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/sonar/reception/one_way_beams.h>
#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/composite_roughness.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/reflection.h>
#include <ensonify/scatter/surface_scatter.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

/// A sonar whose range has the multiples.
Sonar long_sonar() {
  Sonar sonar = open_sonar();
  sonar.bins = 3000;
  return sonar;
}

/// An echo from this range alone, in `reach` bins on either side.
std::vector<float> echo_from(double range_m, const Sonar& sonar, std::size_t reach = 4) {
  std::vector<float> echo(static_cast<std::size_t>(sonar.bins), 0.0f);
  const auto lit = static_cast<std::size_t>(range_m / sonar.bin_m());
  std::fill_n(echo.begin() + static_cast<std::ptrdiff_t>(lit - reach), 2 * reach + 1, 1e9f);
  return echo;
}

/// What was received within `reach` bins of a range.
double energy_about(double range_m, const std::vector<double>& received, const Sonar& sonar,
                    std::ptrdiff_t reach = 20) {
  const auto bin = static_cast<std::ptrdiff_t>(range_m / sonar.bin_m());
  return std::accumulate(received.begin() + bin - reach, received.begin() + bin + reach + 1, 0.0);
}

}  // namespace

TEST_CASE("multiples have the ranges of image sources, from below and from the side") {
  const Sonar sonar = long_sonar();
  // One place of the bed has an echo: straight below, or 20 m to the side.
  for (const double over_m : {0.5, 20.0}) {
    const double r = std::hypot(over_m, altitude_m);
    const std::vector<float> direct = echo_from(r, sonar, 2);
    std::vector<double> all =
        received(sonar, {.multiples = true, .bottom_loss_db = 0.0}, direct, {.wind_mps = 0.0});
    for (std::size_t i = 0; i < all.size(); ++i) all[i] -= direct[i];
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
}

TEST_CASE("a multiple by the surface keeps the energy of its legs' spreading") {
  const Sonar sonar = long_sonar();
  const double over_m = 15.0, r = std::hypot(over_m, altitude_m);
  const std::vector<float> direct = echo_from(r, sonar);
  const SeaState calm{.wind_mps = 0.0};
  const std::vector<double> with =
      received(sonar, {.multiples = true, .bottom_loss_db = 200.0}, direct, calm);
  const double back_m = std::hypot(over_m, altitude_m + 2.0 * depth_m);
  // Two directions, each with r^2 r'^2 instead of r^4, and absorption over the longer leg. Along
  // the track sinc^2(L y / lambda r) sinc^2(L y / lambda r') has the integral
  // lambda r / L (1 - r / (3 r')), which for equal legs is 2/3 lambda r / L.
  const double wider = 1.5 * (1.0 - r / (3.0 * back_m));
  const double expected =
      9e9 * 2.0 * std::pow(r / back_m, 2) * wider * scatter::from_db(-0.03 * (back_m - r));
  CHECK(energy_about(0.5 * (r + back_m), with, sonar) == Approx(expected).epsilon(0.02));
  // That of an image of the sonar at the range r': both legs are its own.
  const double as_image =
      9e9 * std::pow(r / back_m, 4) * (back_m / r) * scatter::from_db(-0.06 * (back_m - r));
  CHECK(energy_about(back_m, with, sonar) == Approx(as_image).epsilon(0.02));
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
  // transmission and received at the pose when the echo is back.
  const Sonar sonar = long_sonar();
  const double wavelength_m = 1500.0 / sonar.frequency_hz, up_m = altitude_m + 2.0 * depth_m;
  struct Case {
    double pitch_deg;
    Pose motion;
  };
  for (const Case& of :
       {Case{0.1, {}}, Case{0.25, {}}, Case{0.6, {}}, Case{3.0, {}},
        Case{0.1, {.velocity_mps = {0.0, 3.0, 0.0}}}, Case{-0.2, {.pitch_rate_radps = 0.04}},
        Case{0.0, {.heading_rate_radps = 0.03}},
        Case{0.1, {.velocity_mps = {0.0, 2.0, 0.0}, .pitch_rate_radps = -0.04}}}) {
    // Not a structured binding: the compiler of the sanitized tests, Clang 14, cannot capture one.
    const double pitch_deg = of.pitch_deg;
    const Pose& motion = of.motion;
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

namespace {

/// How far a leg moves along the track at the bed, per slope along the track of a facet that
/// reflects it: from the facet's normal, which halves the directions to both ends. The leg begins
/// at a place of the bed, has the extent `down_m`, is reflected at that height over the bed, and is
/// drawn without its other reflections.
double moved_per_slope_m(double over_m, double down_m, double bounce_m) {
  const double y_m = 1e-3, share = bounce_m / down_m;
  const Eigen::Vector3d facet{over_m * share, y_m, bounce_m};
  const Eigen::Vector3d to_bed = -facet.normalized();
  Eigen::Vector3d to_array = Eigen::Vector3d{over_m, 0.0, 2.0 * bounce_m - down_m} - facet;
  const double left_m = to_array.norm();
  to_array.normalize();
  const Eigen::Vector3d normal = to_bed + to_array;
  return y_m / left_m * std::hypot(over_m, down_m) / std::abs(normal.y() / normal.z());
}

/// What is left of the overlap of two legs' patterns if sound is spread along the track.
double share_within_beams(const Sonar& sonar, double leg_m, double other_m, double spread_m) {
  const OneWayBeams beams(sonar, 1500.0 / sonar.frequency_hz, 200.0);
  const double step_m = 0.02, reach_m = 4.0;
  double sum = 0.0, without = 0.0;
  for (double y_m = -reach_m; y_m < reach_m; y_m += step_m)
    for (double z_m = -reach_m; z_m < reach_m; z_m += step_m) {
      const double both = beams.power(OneWayBeams::transmitter, leg_m, std::abs(y_m)) *
                          beams.power(OneWayBeams::receiver, other_m, std::abs(z_m));
      sum += both * std::exp(-0.5 * std::pow((y_m - z_m) / spread_m, 2)) * step_m /
             (std::sqrt(2.0 * std::numbers::pi) * spread_m);
      if (y_m == z_m) without += both;
    }
  return sum / without;
}

}  // namespace

TEST_CASE("a multiple loses the bubble loss of the wind, and what waves reflect past the beam") {
  // APL-UW TR 9407: 15 dB per reflection at 400 kHz, 30 degrees, 10 m/s; slopes by its eq. 12.
  CHECK(scatter::bubble_loss_db({.wind_mps = 10.0, .frequency_hz = 400e3},
                                std::numbers::pi / 6.0) == Approx(15.2).margin(0.1));
  const Sonar sonar = long_sonar();
  const double over_m = 10.0, r = std::hypot(over_m, altitude_m);
  const std::vector<float> direct = echo_from(r, sonar);
  const double up_m = altitude_m + 2.0 * depth_m, around_m = 3.0 * altitude_m + 2.0 * depth_m;
  const double by_surface = std::hypot(over_m, up_m), by_bed = std::hypot(over_m, around_m);
  const auto energies = [&](double wind_mps) {
    const std::vector<double> all =
        received(sonar, {.multiples = true, .bottom_loss_db = 0.0}, direct, {.wind_mps = wind_mps});
    std::array<double, 3> sums{};
    const double ranges[] = {0.5 * (r + by_surface), by_surface, 0.5 * (r + by_bed)};
    for (std::size_t i = 0; i < 3; ++i) sums[i] = energy_about(ranges[i], all, sonar, 25);
    return sums;
  };
  const auto calm = energies(0.0);
  for (const double wind_mps : {5.0, 7.0}) {
    const scatter::SeaSurface sea{.wind_mps = wind_mps, .frequency_hz = sonar.frequency_hz};
    const double slope = std::sqrt(0.5 * 4.6e-3 * std::log(2.1 * wind_mps * wind_mps));
    const double water_m = altitude_m + depth_m;
    const double spread_m = slope * moved_per_slope_m(over_m, up_m, water_m),
                 around_spread_m = slope * moved_per_slope_m(over_m, around_m, water_m);
    const double once_db = scatter::bubble_loss_db(sea, std::atan2(up_m, over_m));
    const double expected_db[] = {
        once_db - scatter::to_db(share_within_beams(sonar, r, by_surface, spread_m)),
        2.0 * once_db - scatter::to_db(share_within_beams(sonar, by_surface, by_surface,
                                                          std::sqrt(2.0) * spread_m)),
        scatter::bubble_loss_db(sea, std::atan2(around_m, over_m)) -
            scatter::to_db(share_within_beams(sonar, r, by_bed, around_spread_m))};
    const auto windy = energies(wind_mps);
    for (std::size_t i = 0; i < 3; ++i) {
      CAPTURE(wind_mps, i, once_db);
      CHECK(-scatter::to_db(windy[i] / calm[i]) ==
            Approx(expected_db[i]).margin(0.3));  // waves lift the surface
    }
  }
}

TEST_CASE("a bed with relief reflects most of a multiple past the beam") {
  // Only the bed spreads the multiple, because the sea surface is calm.
  const Sonar sonar = long_sonar();
  const double over_m = 20.0, r = std::hypot(over_m, altitude_m);
  const std::vector<float> direct = echo_from(r, sonar);
  const double around_m = 3.0 * altitude_m + 2.0 * depth_m, by_bed = std::hypot(over_m, around_m);
  const auto energy = [&](std::optional<scatter::Sediment> bed) {
    const std::vector<double> all = received(sonar, {.multiples = true, .bottom_loss_db = 0.0},
                                             direct, {.wind_mps = 0.0}, {.bed = bed});
    return energy_about(0.5 * (r + by_bed), all, sonar);
  };
  for (const char* name : {"medium sand", "gravel"}) {
    const scatter::Sediment bed = scatter::sediment_named(name);
    const double slope =
        scatter::rms_slope(bed, scatter::relief_wavenumber_per_cm(bed, sonar.frequency_hz, 1500.0));
    const double spread_m =
        slope * moved_per_slope_m(over_m, around_m, 2.0 * (altitude_m + depth_m));
    CAPTURE(name, slope, spread_m);
    CHECK(scatter::to_db(energy(bed) / energy({})) ==
          Approx(scatter::to_db(share_within_beams(sonar, r, by_bed, spread_m))).margin(0.3));
  }
}

TEST_CASE("a multiple by the bed loses the sediment's reflection loss at that angle") {
  const Sonar sonar = long_sonar();
  const SeaState calm{.wind_mps = 0.0};
  const scatter::Sediment sand = scatter::sediment_named("medium sand");
  for (const double over_m : {0.5, 20.0}) {
    const double r = std::hypot(over_m, altitude_m);
    const std::vector<float> direct = echo_from(r, sonar);
    const double down_m = 3.0 * altitude_m + 2.0 * depth_m, back_m = std::hypot(over_m, down_m);
    const auto energy = [&](std::optional<double> loss_db, std::optional<scatter::Sediment> bed) {
      const std::vector<double> all = received(
          sonar, {.multiples = true, .bottom_loss_db = loss_db}, direct, calm, {.bed = bed});
      return energy_about(0.5 * (r + back_m), all, sonar);
    };
    const double whole = energy(0.0, sand);
    const double loss_db = scatter::reflection_loss_db(sand, std::asin(down_m / back_m));
    CAPTURE(over_m, loss_db);
    CHECK(-scatter::to_db(energy({}, sand) / whole) == Approx(loss_db).margin(0.02));
    CHECK(-scatter::to_db(energy(6.0, sand) / whole) == Approx(6.0).margin(0.02));
    CHECK(-scatter::to_db(energy({}, {}) / energy(0.0, {})) == Approx(10.0).margin(0.02));
    // |R(90)| of medium sand by the handbook's regressions is 0.369775.
    if (over_m < 1.0) CHECK(loss_db == Approx(-20.0 * std::log10(0.369775)).margin(0.05));
  }
}

TEST_CASE("a multiple has the bed's strength at both of its legs' grazing angles") {
  const Sonar sonar = long_sonar();
  const SeaState calm{.wind_mps = 0.0};
  const auto lambert = [](double sine) { return 2e-3 * sine * sine; };
  for (const double over_m : {5.0, 28.0, 60.0}) {
    const double r = std::hypot(over_m, altitude_m);
    const std::vector<float> direct = echo_from(r, sonar);
    const double up_m = altitude_m + 2.0 * depth_m, back_m = std::hypot(over_m, up_m);
    const auto energy = [&](const std::function<double(double)>& strength) {
      const std::vector<double> all = received(sonar, {.multiples = true, .bottom_loss_db = 200.0},
                                               direct, calm, {.strength = strength});
      return energy_about(0.5 * (r + back_m), all, sonar);
    };
    // Lambert's law: mu sin g sin g' divided by mu sin^2 g.
    const double expected_db = scatter::to_db((up_m / back_m) / (altitude_m / r));
    CAPTURE(over_m);
    CHECK(scatter::to_db(energy(lambert) / energy([](double) { return 2e-3; })) ==
          Approx(expected_db).margin(0.02));
  }
}

TEST_CASE("multiples do not follow from side lobes where a measured pattern hides the bed") {
  // The direct echo there is all side lobes; the multiples come from directions that are not
  // hidden.
  const auto loudest = [](double hidden_db) {
    Sonar sonar = long_sonar();
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
