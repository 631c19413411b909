#include <ensonify/engine/sonar/reception/artefacts.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "support/catch.h"
#include "support/lines.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

constexpr double altitude_m = 10.0;
const Eigen::Vector3d array_place{0.0, 0.0, -10.0};

/// An array that heads north with its bow up by an angle.
ArrayFrame pitched(const Eigen::Vector3d& here, double bow_up_rad) {
  const double c = std::cos(bow_up_rad), s = std::sin(bow_up_rad);
  return {here, {0, c, s}, {0, s, -c}};
}

/// Makes the starboard lines of a sonar with artefacts, without speckle.
struct Receiver {
  explicit Receiver(const ArtefactOptions& options, bool noise = false,
                    const Sonar& its_sonar = quiet_sonar())
      : sonar(its_sonar),
        chain((sonar.receiver.noise = noise, sonar), {.speckle = false, .artefacts = options}) {}

  EchoLine receive(std::uint64_t ping = 0, double t_s = 0.0, double north_m = 0.0,
                   double strength = 1.0) {
    const Eigen::Vector3d here = array_place + north_m * Eigen::Vector3d::UnitY();
    EchoLine line = level_line(sonar, starboard_sector, here, altitude_m);
    for (float& mean : line.bins.intensity_mean) mean *= static_cast<float>(strength);
    receive_lines(chain,
                  {.ping = ping, .t_s = t_s, .array = {here, {0, 1, 0}}, .altitude_m = altitude_m},
                  std::span(&line, 1), scratch);
    return line;
  }

  Sonar sonar;
  SignalChain chain;
  SignalChain::Scratch scratch;
};

}  // namespace

TEST_CASE("a line without artefacts lists none, and a line with artefacts lists them") {
  CHECK(Receiver({}).receive().artefacts.text().empty());
  Artefacts two;
  two.add(Artefact::lost);
  two.add(Artefact::shimmer);
  CHECK(two.text() == "lost+shimmer");
}

TEST_CASE("pings are lost and repeated at their rates, the first never repeated") {
  const ArtefactOptions options{.lost = 0.1, .repeated = 0.25};
  int lost = 0, repeated = 0;
  for (std::uint64_t ping = 0; ping < 20000; ++ping) {
    lost += is_lost(options, 7, ping);
    repeated += is_repeated(options, 7, ping);
  }
  CHECK(lost == Approx(2000).margin(150));
  CHECK(repeated == Approx(5000).margin(250));
  CHECK_FALSE(is_repeated({.repeated = 1.0}, 7, 0));
  CHECK_FALSE(is_lost({}, 7, 3));
}

TEST_CASE("the navigation is stale for its share of the time") {
  const ArtefactOptions options{.stale_navigation = 0.3, .stale_s = 2.0};
  std::vector<Pose> reports(20000);
  for (std::size_t i = 0; i < reports.size(); ++i) {
    reports[i].t_s = 0.1 * static_cast<double>(i);
    reports[i].position.x() = reports[i].t_s;
  }
  const std::vector<Pose> poses = reports;
  for (std::size_t i = 0; i < reports.size(); ++i) {
    reports[i] = poses[reporting_ping(options, 3, poses, i)];
    reports[i].t_s = poses[i].t_s;
  }
  int stale = 0;
  for (std::size_t i = 1; i < reports.size(); ++i) {
    REQUIRE(reports[i].t_s == 0.1 * static_cast<double>(i));
    const bool moved = reports[i].position.x() == reports[i].t_s;
    stale += !moved;
    if (!moved) REQUIRE(reports[i].position == reports[i - 1].position);
    REQUIRE(moved == (reported_since_s(options, 3, reports[i].t_s) == reports[i].t_s));
  }
  CHECK(stale / 20000.0 == Approx(0.3).margin(0.05));
}

TEST_CASE("another sonar is received at a fixed range, or moves by a constant from ping to ping") {
  const auto loudest = [](const ArtefactOptions& options, std::uint64_t ping) {
    const EchoLine line = Receiver(options, true).receive(ping, 0.0, 0.0, 0.0);
    CHECK(line.artefacts.has(Artefact::interference));
    const auto peak = std::ranges::max_element(line.bins.intensity);
    CHECK(*peak / line.bins.intensity.back() == Approx(1001.0).epsilon(0.01));  // 30 dB and noise
    return static_cast<int>(peak - line.bins.intensity.begin());
  };
  const ArtefactOptions fixed{.interference_db = 30.0, .interference_range_m = 20.0};
  for (const std::uint64_t ping : {0, 5, 100}) CHECK(loudest(fixed, ping) == 400);
  ArtefactOptions moving = fixed;
  moving.interference_drift_m = 1.5;
  for (const std::uint64_t ping : {0, 1, 10}) CHECK(loudest(moving, ping) == 400 + 30 * int(ping));
  CHECK(loudest(moving, 40) == 400 + 30 * 40 - 1500);  // wraps around at the last bin
  // Interference that stays beyond the range of 75 m is not received.
  const EchoLine line =
      Receiver({.interference_db = 30.0, .interference_range_m = 80.0}, true).receive(0, 0, 0, 0);
  CHECK_FALSE(line.artefacts.has(Artefact::interference));
  CHECK(std::ranges::max(line.bins.intensity) == Approx(line.bins.intensity.back()));
}

TEST_CASE("another sonar's pulse fills as many bins as its length has") {
  for (const auto& [length_m, bins] : {std::pair{0.0, 1}, {0.12, 2}, {1.0, 20}}) {
    const EchoLine line = Receiver({.interference_db = 30.0,
                                    .interference_range_m = 20.01,
                                    .interference_length_m = length_m},
                                   true)
                              .receive(0, 0.0, 0.0, 0.0);
    const float noise = line.bins.intensity.back();
    CHECK(std::ranges::count_if(line.bins.intensity, [&](float i) { return i > 100.0f * noise; }) ==
          bins);
  }
}

TEST_CASE("another sonar has its level over the noise at the vehicle's speed") {
  Sonar sonar = quiet_sonar();
  sonar.receiver.noise = true;
  sonar.receiver.self_noise_db = 60.0;
  const SignalChain chain(
      sonar,
      {.speckle = false, .artefacts = {.interference_db = 20.0, .interference_range_m = 20.0}});
  SignalChain::Scratch scratch;
  for (const double speed_mps : {0.0, 6.0}) {
    EchoLine line = level_line(sonar, starboard_sector, array_place, altitude_m);
    std::ranges::fill(line.bins.intensity_mean, 0.0f);
    receive_lines(
        chain,
        {.array = {array_place, {0, 1, 0}}, .altitude_m = altitude_m, .speed_mps = speed_mps},
        std::span(&line, 1), scratch);
    CHECK(std::ranges::max(line.bins.intensity) / line.bins.intensity.back() ==
          Approx(101.0).epsilon(0.01));
  }
}

TEST_CASE("a gain from ping to ping is the same on both sides and in all bins of a ping") {
  Sonar sonar = quiet_sonar();
  const SignalChain even(sonar, {.speckle = false});
  sonar.receiver.ping_gain_db = 1.5;
  const SignalChain chain(sonar, {.speckle = false});
  SignalChain::Scratch scratch;
  double squares = 0.0, products = 0.0, before_db = 0.0;
  constexpr int pings = 1000;
  for (int ping = 0; ping < pings; ++ping) {
    std::array<EchoLine, 2> lines{level_line(sonar, port_sector, array_place, altitude_m),
                                  level_line(sonar, starboard_sector, array_place, altitude_m)};
    for (EchoLine& line : lines)
      for (float& mean : line.bins.intensity_mean) mean *= 1e9f;
    std::array<EchoLine, 2> usual = lines;
    const LineContext context{.ping = static_cast<std::uint64_t>(ping),
                              .t_s = 0.1 * ping,
                              .array = {array_place, {0, 1, 0}},
                              .altitude_m = altitude_m};
    receive_lines(even, context, usual, scratch);
    receive_lines(chain, context, lines, scratch);
    REQUIRE(lines[0].gain == lines[1].gain);
    REQUIRE(lines[0].bins.intensity == usual[0].bins.intensity);
    REQUIRE(usual[1].bins.sample[700] > 1000);
    REQUIRE(lines[1].bins.sample[700] ==
            Approx(lines[1].gain * static_cast<float>(usual[1].bins.sample[700])).margin(1.0));
    CHECK(lines[0].artefacts.text() == usual[0].artefacts.text());
    const double db = scatter::amplitude_to_db(lines[0].gain);
    squares += db * db;
    products += db * before_db;
    before_db = db;
  }
  CHECK(std::sqrt(squares / pings) == Approx(1.5).epsilon(0.07));
  CHECK(std::abs(products / squares) < 0.1);
}

TEST_CASE("gain steps change the recorded samples and not the received intensity") {
  const ArtefactOptions options{.gain_step_db = 6.0, .gain_step_s = 10.0};
  Receiver receiver(options);
  const EchoLine before = receiver.receive(0, 9.0, 0.0, 1e9);
  CHECK_FALSE(before.artefacts.has(Artefact::gain_step));
  double sum = 0.0;
  constexpr int steps = 200;
  for (int step = 1; step <= steps; ++step) {
    const EchoLine after = receiver.receive(0, 10.0 * step + 1.0, 0.0, 1e9);
    CHECK(after.artefacts.has(Artefact::gain_step));
    REQUIRE(after.bins.intensity == before.bins.intensity);
    const double db = 20.0 * std::log10(double(after.bins.sample[700]) / before.bins.sample[700]);
    if (after.bins.sample[700] < 32767)
      CHECK(20.0 * std::log10(after.gain) == Approx(db).margin(0.1));
    sum += db * db;
  }
  CHECK(std::sqrt(sum / steps) == Approx(6.0).epsilon(0.2));
}

TEST_CASE("an automatic gain removes its share of a level change") {
  const auto sample = [](double share, double strength) {
    const EchoLine line =
        Receiver({.automatic_gain = share, .automatic_gain_m = 2.0}).receive(0, 0.0, 0.0, strength);
    return double(line.bins.sample[1400]);
  };
  for (const double share : {0.3, 0.8})
    CHECK(20.0 * std::log10(sample(share, 1e8) / sample(share, 1e7)) ==
          Approx(10.0 * (1.0 - share)).margin(0.4));
}

TEST_CASE("a fish's shadow lies where the line of sight above it meets the bed") {
  const ArtefactOptions options{.fish_per_hectare = 40.0, .fish_height_m = 5.0};
  Receiver receiver(options);
  int fish = 0, shadows = 0;
  for (double north_m = 0.0; north_m < 200.0; north_m += 0.1) {
    const EchoLine line = receiver.receive(0, 0.0, north_m, 1e6);
    if (!line.artefacts.has(Artefact::fish)) continue;
    // One fish at a time over a bed with echoes: the darkest bin behind the brightest.
    const auto& i = line.bins.intensity;
    const auto bright = std::ranges::max_element(i);
    const auto dark = std::min_element(i.begin() + line.first_return + 2, i.end());
    if (*bright < 2e6f || *dark > 0.8e6f) continue;
    ++fish;
    const double r = line.bins.range_m[static_cast<std::size_t>(bright - i.begin())];
    const double shadow_m = line.bins.range_m[static_cast<std::size_t>(dark - i.begin())];
    // The line of sight has the length r when it is h - t below the sonar, and r h / (h - t)
    // when it is h below, for t of 0..5 m.
    shadows += shadow_m >= r && shadow_m <= r * altitude_m / (altitude_m - 5.2) + 0.2;
  }
  CHECK(fish > 20);
  CHECK(shadows >= 0.9 * fish);
  CHECK_FALSE(Receiver({.fish_per_hectare = 1e-9}).receive().artefacts.has(Artefact::fish));
}

TEST_CASE("a fish's shadow is as dark as its height over that and the Fresnel zone") {
  Sonar sonar = quiet_sonar();
  sonar.focused = true;
  constexpr double length_m = 0.08, thick_m = 0.25 * length_m;
  // The share of sinc^4 within a width about its middle; its integral is 2/3.
  const auto beam_share = [](double width) {
    constexpr int steps = 1000;
    double sum = 0.0;
    for (int i = 0; i < steps; ++i) {
      const double x = std::numbers::pi * width * ((i + 0.5) / steps - 0.5);
      sum += std::pow(std::sin(x) / x, 4.0) / steps;
    }
    return sum * width / (2.0 / 3.0);
  };
  Receiver receiver({.fish_per_hectare = 20.0,
                     .fish_strength_db = 0.0,
                     .fish_length_m = length_m,
                     .fish_height_m = 5.0},
                    false, sonar);
  const double wavelength_m = 1500.0 / sonar.frequency_hz;
  struct Fish {
    double away_m, bed_m, darkness;
  };
  std::vector<Fish> darkest;  // of each fish, where the beam's middle meets it
  double last_north_m = -1.0;
  for (double north_m = 0.0; north_m < 800.0; north_m += 0.05) {
    const EchoLine line = receiver.receive(0, 0.0, north_m, 1.0);
    if (!line.artefacts.has(Artefact::fish)) continue;
    const auto& i = line.bins.intensity;
    const auto bright = std::ranges::max_element(i);
    const auto dark = std::min_element(i.begin() + line.first_return + 2, i.end());
    const auto at_m = [&](auto bin) {
      return double(line.bins.range_m[static_cast<std::size_t>(bin - i.begin())]);
    };
    const Fish now{at_m(bright), at_m(dark), 1.0 - double(*dark)};
    if (darkest.empty() || north_m - last_north_m > 0.06 ||
        std::abs(now.away_m - darkest.back().away_m) > 0.1)
      darkest.push_back(now);
    else if (now.darkness > darkest.back().darkness)
      darkest.back() = now;
    last_north_m = north_m;
  }
  std::vector<double> ratios;
  for (const Fish& fish : darkest) {
    if (fish.darkness < 1e-3 || fish.bed_m < fish.away_m + 1.0) continue;  // no shadow of its own
    const double zone_m =
        std::sqrt(wavelength_m * fish.away_m * (fish.bed_m - fish.away_m) / fish.bed_m);
    const double share = beam_share(length_m * sonar.array_length_m / (wavelength_m * fish.away_m));
    ratios.push_back(fish.darkness / (share * thick_m / std::hypot(thick_m, zone_m)));
  }
  REQUIRE(ratios.size() > 20);
  std::ranges::sort(ratios);
  CHECK(ratios[ratios.size() / 2] == Approx(1.0).margin(0.05));
}

TEST_CASE("a fish's echo has its strength, whatever the bins and the pulse") {
  // The energy of all echoes of a line with many small fish, divided by the energy of a cell.
  const auto energy = [](int bins, double bandwidth_hz) {
    Sonar sonar = quiet_sonar();
    sonar.bins = bins;
    sonar.pulse.bandwidth_hz = bandwidth_hz;
    sonar.focused = true;
    Receiver receiver({.fish_per_hectare = 2000.0, .fish_strength_db = 0.0, .fish_length_m = 0.05},
                      false, sonar);
    double sum = 0.0;
    for (double north_m = 0.0; north_m < 40.0; north_m += 0.5) {
      const EchoLine line = receiver.receive(0, 0.0, north_m, 0.0);
      for (std::size_t i = line.bins.intensity.size() / 2; i < line.bins.intensity.size(); ++i)
        sum += double(line.bins.intensity[i]) * std::pow(double(line.bins.range_m[i]), 4.0);
    }
    return sum * sonar.bin_m() / sonar.pulse.cell_m(1500.0);
  };
  const double usual = energy(1500, 30e3);
  CHECK(energy(600, 30e3) == Approx(usual).epsilon(0.1));
  CHECK(energy(1500, 5e3) == Approx(usual).epsilon(0.1));
}

TEST_CASE(
    "a long fish echoes as the mean of small ones along its length, and no more over a pass") {
  constexpr double step_m = 0.02;
  const auto pass = [](double length_m) {
    Sonar sonar = quiet_sonar();
    sonar.focused = true;
    Receiver receiver({.fish_per_hectare = 500.0,
                       .fish_strength_db = 0.0,
                       .fish_length_m = length_m,
                       .fish_height_m = 5.0},
                      false, sonar);
    std::vector<double> energy;  // of each ping
    for (double north_m = 0.0; north_m < 20.0; north_m += step_m) {
      const EchoLine line = receiver.receive(0, 0.0, north_m, 0.0);
      energy.push_back(
          std::accumulate(line.bins.intensity.begin(), line.bins.intensity.end(), 0.0));
    }
    return energy;
  };
  const std::vector<double> small = pass(step_m);
  for (const std::size_t steps : {21u, 51u}) {
    const std::vector<double> of_long = pass(static_cast<double>(steps) * step_m);
    const double strongest = std::ranges::max(of_long);
    REQUIRE(strongest > 0.0);
    for (std::size_t ping = steps / 2; ping + steps / 2 < small.size(); ++ping) {
      const auto from = small.begin() + static_cast<std::ptrdiff_t>(ping - steps / 2);
      const double mean = std::accumulate(from, from + static_cast<std::ptrdiff_t>(steps), 0.0) /
                          static_cast<double>(steps);
      CAPTURE(steps, ping);
      REQUIRE(of_long[ping] == Approx(mean).epsilon(0.05).margin(0.01 * strongest));
    }
  }
}

TEST_CASE("fish near an array that is not focused hide no more than all, and give numbers") {
  // There the beam can be stronger off its axis than on it.
  Receiver receiver({.fish_per_hectare = 5000.0, .fish_length_m = 2.0});
  bool fish = false;
  for (double north_m = 0.0; north_m < 100.0; north_m += 0.25) {
    const EchoLine line = receiver.receive(0, 0.0, north_m, 1e6);
    fish = fish || line.artefacts.has(Artefact::fish);
    for (const float value : line.bins.intensity)
      if (!(value >= 0.0f)) FAIL("an intensity is " << value);
  }
  CHECK(fish);
}

TEST_CASE("fish swim below the sea surface") {
  // A beam of 20 degrees that looks up meets them as far as its lower edge meets the surface.
  Sonar sonar = quiet_sonar();
  sonar.vertical.beamwidth_rad = 20.0 * degree;
  sonar.vertical.tilt_rad = -30.0 * degree;
  sonar.vertical.floor_db = -60.0;
  const Eigen::Vector3d shallow{0.0, 0.0, -3.0};  // in 5 m of water
  const auto lines = [&](double height_m) {
    const SignalChain chain(
        sonar,
        {.speckle = false, .artefacts = {.fish_per_hectare = 2000.0, .fish_height_m = height_m}});
    SignalChain::Scratch scratch;
    std::vector<float> all;
    for (double north_m = 0.0; north_m < 100.0; north_m += 1.0) {
      const Eigen::Vector3d here = shallow + north_m * Eigen::Vector3d::UnitY();
      EchoLine line = level_line(sonar, starboard_sector, here, 2.0);
      std::ranges::fill(line.bins.intensity_mean, 0.0f);
      receive_lines(chain, {.array = {here, {0, 1, 0}}, .altitude_m = 2.0}, std::span(&line, 1),
                    scratch);
      all.insert(all.end(), line.bins.intensity.begin(), line.bins.intensity.end());
    }
    return all;
  };
  const std::vector<float> all = lines(50.0);
  double within = 0.0, beyond = 0.0;  // 3 m up at 20 degrees and more, or less
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double r = (double(i % 1500) + 0.5) * sonar.bin_m();
    // The beam's part of a fish grows with the range.
    (r < 3.0 / std::sin(20.0 * degree) ? within : beyond) += double(all[i]) * std::pow(r, 3.0);
  }
  CHECK(within > 0.0);
  CHECK(beyond < within);
  CHECK((all == lines(5.0)));
  CHECK((all != lines(4.0)));
}

TEST_CASE("a pitched array meets as many fish, and a wake where its beam meets the surface") {
  const auto pings_with_fish = [](double bow_up_rad) {
    Receiver receiver({.fish_per_hectare = 40.0});
    int pings = 0;
    for (double north_m = 0.0; north_m < 400.0; north_m += 1.0) {
      const Eigen::Vector3d here = array_place + north_m * Eigen::Vector3d::UnitY();
      EchoLine line = level_line(receiver.sonar, starboard_sector, here, 60.0);
      receive_lines(receiver.chain, {.array = pitched(here, bow_up_rad), .altitude_m = 60.0},
                    std::span(&line, 1), receiver.scratch);
      pings += line.artefacts.has(Artefact::fish);
    }
    return pings;
  };
  const int level = pings_with_fish(0.0);
  CHECK(level > 50);
  CHECK(pings_with_fish(-20.0 * degree) == Approx(level).epsilon(0.25));

  // A ship's track to the east, as far north as the beam of an array 10 m below meets the surface,
  // or as far south. With heading east, starboard is south.
  const auto energy = [](double bow_up_rad, double offset_m) {
    Receiver receiver({.wake_db = 0.0,
                       .wake_heading_rad = 90.0 * degree,
                       .wake_width_m = 2.0,
                       .wake_offset_m = offset_m});
    EchoLine line = level_line(receiver.sonar, starboard_sector, array_place, altitude_m);
    std::ranges::fill(line.bins.intensity_mean, 0.0f);
    receive_lines(receiver.chain,
                  {.array = pitched(array_place, bow_up_rad), .altitude_m = altitude_m},
                  std::span(&line, 1), receiver.scratch);
    return std::accumulate(line.bins.intensity.begin(), line.bins.intensity.end(), 0.0);
  };
  const double north_m = 10.0 * std::tan(20.0 * degree);
  CHECK(energy(-20.0 * degree, -north_m) == Approx(energy(0.0, 0.0)).epsilon(0.15));
  CHECK(energy(-20.0 * degree, north_m) < 1e-3 * energy(0.0, 0.0));
}

TEST_CASE("a wake appears in the image at the range of the ship's track") {
  // The surface is 10 m above; a track to the north, 20 m to starboard, appears at sqrt(20^2 +
  // 10^2) m.
  const EchoLine line =
      Receiver(
          {.wake_db = 0.0, .wake_heading_rad = 0.0, .wake_width_m = 2.0, .wake_offset_m = 20.0})
          .receive(0, 0.0, 0.0, 0.0);
  CHECK(line.artefacts.has(Artefact::wake));
  const auto peak = std::ranges::max_element(line.bins.intensity) - line.bins.intensity.begin();
  CHECK(line.bins.range_m[static_cast<std::size_t>(peak)] ==
        Approx(std::hypot(20.0, 10.0)).margin(0.4));
}

TEST_CASE("a wake's echo is as long as the pulse, and has the energy of its strength and width") {
  // A track to the north, 40 m to starboard and 10 m above: a thin line at the slant range r.
  const double r = std::hypot(40.0, 10.0), width_m = 0.3;
  for (const PulseKind kind : {PulseKind::cw, PulseKind::lfm})
    for (const int bins : {1500, 150}) {
      Sonar sonar = quiet_sonar();
      sonar.bins = bins;
      sonar.focused = true;
      sonar.vertical.beamwidth_rad = 0.0;
      sonar.pulse = {.kind = kind, .bandwidth_hz = 500.0, .length_s = 2e-3};
      const SignalChain chain(sonar, {.speckle = false,
                                      .sea = {.wind_mps = 0.0},
                                      .artefacts = {.wake_db = 0.0,
                                                    .wake_heading_rad = 0.0,
                                                    .wake_width_m = width_m,
                                                    .wake_offset_m = 40.0}});
      SignalChain::Scratch scratch;
      EchoLine line = level_line(sonar, starboard_sector, array_place, altitude_m);
      std::ranges::fill(line.bins.intensity_mean, 0.0f);
      receive_lines(chain, {.array = {array_place, {0, 1, 0}}, .altitude_m = altitude_m},
                    std::span(&line, 1), scratch);
      double sum = 0.0, moment_m = 0.0, first_m = 0.0, last_m = 0.0;
      for (std::size_t i = 0; i < line.bins.intensity.size(); ++i) {
        const double intensity = double(line.bins.intensity[i]), at_m = line.bins.range_m[i];
        sum += intensity;
        moment_m += intensity * at_m;
        if (intensity > 0.0) last_m = at_m;
        if (intensity > 0.0 && first_m == 0.0) first_m = at_m;
      }
      const double cell_m = 1.5, bin_m = sonar.bin_m();
      CAPTURE(static_cast<int>(kind), bins);
      // A CW pulse fills the cell behind the range, a sweep lies about it.
      const double middle_m = kind == PulseKind::cw ? r + 0.5 * cell_m : r;
      CHECK(moment_m / sum == Approx(middle_m).margin(0.02 + 0.5 * bin_m));
      CHECK(last_m - first_m == Approx(cell_m).margin(2.0 * bin_m + 2.0 * width_m));
      // The Gaussian's integral, to 2 of its widths, over the surface, and the beam of sinc^4.
      const double wide_m = 0.5 * width_m * std::sqrt(std::numbers::pi) * std::erf(2.0);
      const double along_m = 2.0 / 3.0 * r * 1500.0 / sonar.frequency_hz / sonar.array_length_m;
      const double expected =
          scatter::from_db(sonar.source_level_db) / std::pow(r, 4) * wide_m * along_m * cell_m;
      CHECK(scatter::to_db(sum * bin_m / expected) == Approx(0.0).margin(0.05));
    }
}

TEST_CASE("a wake floats on the waves from which the surface's return comes") {
  const Sonar sonar = quiet_sonar();
  const SeaState windy{.wind_mps = 12.0};
  const SignalChain surface(sonar, {.speckle = false, .sea = windy, .arrivals = {.surface = true}}),
      wake(sonar,
           {.speckle = false, .sea = windy, .artefacts = {.wake_db = 0.0, .wake_width_m = 1000.0}});
  SignalChain::Scratch scratch;
  double lowest_m = 100.0, highest_m = 0.0;
  for (int ping = 0; ping < 20; ++ping) {
    const auto first_m = [&](const SignalChain& chain) {
      EchoLine line = level_line(sonar, starboard_sector, array_place, altitude_m);
      std::ranges::fill(line.bins.intensity_mean, 0.0f);
      receive_lines(
          chain, {.t_s = 0.9 * ping, .array = {array_place, {0, 1, 0}}, .altitude_m = altitude_m},
          std::span(&line, 1), scratch);
      const auto first =
          std::ranges::find_if(line.bins.intensity, [](float i) { return i > 0.0f; });
      return double(first - line.bins.intensity.begin()) * sonar.bin_m();
    };
    const double surface_m = first_m(surface);
    CHECK(first_m(wake) == Approx(surface_m).margin(1.5 * sonar.bin_m()));
    lowest_m = std::min(lowest_m, surface_m);
    highest_m = std::max(highest_m, surface_m);
  }
  CHECK(highest_m - lowest_m > 1.0);  // rms 0.77 m
}

TEST_CASE("shimmer has its rms in decibels and changes with time") {
  Receiver receiver({.shimmer_db = 1.5});
  double sum = 0.0, squares = 0.0;
  int count = 0;
  for (int ping = 0; ping < 500; ++ping) {
    const EchoLine line = receiver.receive(0, 7.7 * ping);
    for (std::size_t i = 300; i < 1500; i += 20, ++count) {
      const double db = scatter::to_db(line.bins.intensity[i]);
      sum += db;
      squares += db * db;
    }
  }
  CHECK(sum / count == Approx(0.0).margin(0.1));
  CHECK(std::sqrt(squares / count) == Approx(1.5).epsilon(0.05));
}

TEST_CASE("shimmer's bands bend, and those of one side are not those of the other") {
  Sonar sonar = quiet_sonar();
  const SignalChain chain(sonar, {.speckle = false, .artefacts = {.shimmer_db = 2.0}});
  SignalChain::Scratch scratch;
  constexpr std::size_t first = 420, last = 1300;  // the first echo is in bin 200
  constexpr std::size_t rows = 80, later = 10;     // 0.6 s each, a tenth of the period
  std::array<std::vector<std::vector<double>>, 2> db;
  for (std::size_t row = 0; row < rows; ++row)
    for (const Sector& sector : sidescan_sectors) {
      EchoLine line = level_line(sonar, sector, array_place, altitude_m);
      receive_lines(chain,
                    {.t_s = 0.6 * static_cast<double>(row),
                     .array = {array_place, {0, 1, 0}},
                     .altitude_m = altitude_m},
                    std::span(&line, 1), scratch);
      std::vector<double>& values = db[sector.number].emplace_back();
      for (const float intensity : line.bins.intensity) values.push_back(scatter::to_db(intensity));
    }
  // Between rows of two sides, the later one shifted by some bins.
  const auto alike = [&](std::size_t side, std::size_t other, std::size_t rows_later,
                         std::ptrdiff_t shift) {
    double ab = 0.0, aa = 0.0, bb = 0.0;
    for (std::size_t row = 0; row + rows_later < rows; ++row)
      for (std::size_t n = first; n < last; n += 5) {
        const double a = db[side][row][n];
        const double b = db[other][row + rows_later]
                           [static_cast<std::size_t>(static_cast<std::ptrdiff_t>(n) + shift)];
        ab += a * b;
        aa += a * a;
        bb += b * b;
      }
    return ab / std::sqrt(aa * bb);
  };
  CHECK(std::abs(alike(0, 1, 0, 0)) < 0.3);
  CHECK(alike(0, 0, 1, 0) > 0.4);  // from ping to ping they are much the same
  // A single wave, or waves of one speed, would reappear unchanged at a later ping, shifted.
  double most = 0.0;
  for (std::ptrdiff_t shift = -200; shift <= 200; shift += 4)
    most = std::max(most, alike(0, 0, later, shift));
  CAPTURE(most);
  CHECK(most < 0.8);
}

TEST_CASE("intensity_mean is free of all artefacts") {
  const ArtefactOptions all{.interference_db = 40.0,
                            .gain_step_db = 3.0,
                            .automatic_gain = 0.5,
                            .fish_per_hectare = 500.0,
                            .wake_db = 0.0,
                            .shimmer_db = 3.0};
  const EchoLine spoilt = Receiver(all).receive(5, 100.0), clean = Receiver({}).receive(5, 100.0);
  CHECK(spoilt.bins.intensity_mean == clean.bins.intensity_mean);
  CHECK(spoilt.bins.intensity != clean.bins.intensity);
}
