#include <ensonify/engine/sonar/reception/signal_kernel.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "support/catch.h"
#include "support/lines.h"
#include "support/targets.h"

#include <ensonify/scatter/ground_texture.h>

using namespace ensonify::engine;
using namespace ensonify::tests;
using ensonify::scatter::GammaTable;

namespace {

/// The samples and intensities of both sides of a sonar in some pings, with every option on.
std::vector<float> everything(const Sonar& sonar) {
  ChainOptions options;
  options.absorption_db_per_m = 0.05;
  options.arrivals = {.surface = true,
                      .volume = true,
                      .multiples = true,
                      .double_bounce = true,
                      .burst_m = 0.3,
                      .crosstalk_db = -30.0};
  options.artefacts = {.interference_db = 30.0,
                       .gain_step_db = 3.0,
                       .automatic_gain = 0.5,
                       .fish_per_hectare = 100.0,
                       .wake_db = -10.0,
                       .shimmer_db = 1.5};
  const SignalChain chain(sonar, options);
  SignalChain::Scratch scratch;
  std::vector<float> all;
  for (std::uint64_t ping = 0; ping < 3; ++ping) {
    const Eigen::Vector3d array{0.4, 0.2 * static_cast<double>(ping), -10.0};
    EchoLine lines[] = {level_line(sonar, port_sector, array, 10.0),
                        level_line(sonar, starboard_sector, array, 10.0)};
    for (EchoLine& line : lines) {
      for (std::size_t i = 0; i < 7; ++i)  // side lobes: energy without a place
        line.bins.intensity_mean[150 + 3 * i] = 1e-3f;
      for (float& mean : line.bins.intensity_mean) mean *= 1e9f;
    }
    const double heading = 0.07 * static_cast<double>(ping);  // between the directions of cells
    receive_lines(chain,
                  {.ping = ping,
                   .t_s = 30.0 * static_cast<double>(ping),
                   .array = {array, {std::sin(heading), std::cos(heading), 0}}},
                  lines, scratch);
    for (const EchoLine& line : lines) {
      all.insert(all.end(), line.bins.intensity.begin(), line.bins.intensity.end());
      for (const std::uint32_t sample : line.bins.sample) all.push_back(static_cast<float>(sample));
    }
  }
  return all;
}

}  // namespace

TEST_CASE("the signal chain gives the same bits on every instruction set") {
  std::vector<Sonar> sonars(4);
  sonars[1].bins = 1499;  // not whole groups
  sonars[1].pulse.kind = PulseKind::lfm;
  sonars[1].receiver = {
      .output_noise_db = -50.0, .looks = 3, .detector = Detector::peak, .ping_mean = 0.2};
  sonars[2].bins = 300;  // shorter pulse than a bin
  sonars[2].receiver.curve = TransferCurve::logarithmic;
  sonars[3].receiver.curve = TransferCurve::square_root;
  sonars[3].receiver.bits = 24;
  for (const Sonar& sonar : sonars) {
    const std::vector<float> expected = everything(sonar);
    CAPTURE(sonar.bins);
    on_each_target([&] { CHECK(everything(sonar) == expected); });
  }
}

TEST_CASE("the kernel's logarithm agrees with std::log2") {
  std::vector<float> amplitudes;
  for (double a = 1e-12; a < 1.5; a *= 1.0007) amplitudes.push_back(static_cast<float>(a));
  std::vector<std::uint32_t> samples(amplitudes.size());
  const double range_db = 200.0, full_scale = 16777215.0;
  digitise({.bins = samples.size(),
            .amplitude = amplitudes.data(),
            .gain = 1.0f,
            .square_root = false,
            .curve_range_db = range_db,
            .full_scale = full_scale,
            .samples = samples.data()});
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double level = 1.0 + 20.0 * std::log10(std::min(1.0, double(amplitudes[i]))) / range_db;
    REQUIRE(std::abs(samples[i] - full_scale * std::max(0.0, level)) <= 0.51);
  }
}

TEST_CASE("no patch of the ground has a strength from beyond its row of the table") {
  // The table is one row of ones. No patch may have the number after the row.
  constexpr float beyond = 1000.0f;
  std::vector<float> quantiles(GammaTable::columns + 1, 1.0f);
  quantiles.back() = beyond;
  constexpr std::uint32_t cells = 1u << 16;
  const std::vector<std::uint32_t> none(signal_group, 0), step_x(signal_group, 1u << patch_bits);
  const std::vector<float> zeros(signal_group, 0.0f), ones(signal_group, 1.0f);
  const std::array<float, 2> weights{};
  std::vector<std::uint32_t> x(signal_group, 0), y(signal_group);
  std::vector<float> re(signal_group), im(signal_group), strengths(signal_group * cells);
  // The random numbers have 24 bits; among four times as many patches some have the greatest.
  float strongest = 0.0f;
  for (std::uint32_t round = 0; round < 64; ++round) {
    for (std::uint32_t bin = 0; bin < signal_group; ++bin)
      y[bin] = (round * signal_group + bin) << patch_bits;
    sum_cells({.across_cell = none.data(),
               .across_within = none.data(),
               .first_cell = none.data(),
               .first_column = zeros.data(),
               .first_weight = none.data(),
               .key = none.data(),
               .phase_turns = zeros.data(),
               .cells_per_m = ones.data(),
               .power = ones.data(),
               .cells = &cells,
               .bins = signal_group,
               .texture = {.x = x.data(),
                           .y = y.data(),
                           .step_x = step_x.data(),
                           .step_y = none.data(),
                           .row = none.data(),
                           .glint_row = none.data(),
                           .glint_share = zeros.data(),
                           .quantiles = quantiles.data(),
                           .key = 1,
                           .strengths = strengths.data(),
                           .known = false},
               .weights = weights.data(),
               .columns_per_cell = 1.0f,
               .last_column = 0,
               .re = re.data(),
               .im = im.data()});
    strongest = std::max(strongest, std::ranges::max(strengths));
  }
  CHECK(strongest == 1.0f);
}
