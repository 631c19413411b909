// Glints whose pulses overlap in time in part.

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "physics/body_in_water.h"
#include "support/catch.h"
#include "support/lines.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/sonar/echo/steady_field.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

/// The energy of the echo of a plane body of upright triangles, before it is turned, by Kirchhoff's
/// integral of every moment of a tone: the integral over time of |sum over the faces' places of
/// exp(2 i k R) p(t - 2 R / c)|^2 / lambda^2, over the pulse's length.
double kirchhoff_in_time_db(const Body& body, const Sonar& sonar, double range_m) {
  const double k = 2.0 * std::numbers::pi * sonar.frequency_hz / 1500.0;
  const double cell_m = sonar.pulse.cell_m(1500.0);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(body.heading_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  struct Edge {
    double at_m;
    std::complex<double> change;
  };
  std::vector<Edge> edges;
  for (const refine::Face& face : body.mesh.faces) {
    const auto corner = [&](std::size_t i) {
      return (turn * body.mesh.positions[face[i]].cast<double>() +
              Eigen::Vector3d(range_m, body.north_m, 0.0))
          .eval();
    };
    const Eigen::Vector3d a = corner(0), one = corner(1) - a, other = corner(2) - a;
    constexpr int steps = 60;
    const double area_m2 = 0.5 * one.cross(other).norm() / (steps * steps);
    const auto add = [&](double u, double v) {
      const double r = (a + u / steps * one + v / steps * other).norm();
      const std::complex<double> field = std::polar(area_m2, 2.0 * k * (r - range_m));
      edges.push_back({r, field});
      edges.push_back({r + cell_m, -field});
    };
    for (int i = 0; i < steps; ++i)
      for (int n = 0; i + n < steps; ++n) {
        add(i + 1.0 / 3.0, n + 1.0 / 3.0);
        if (i + n + 1 < steps) add(i + 2.0 / 3.0, n + 2.0 / 3.0);
      }
  }
  std::ranges::sort(edges, {}, &Edge::at_m);
  std::complex<double> field = 0.0;
  double energy = 0.0;
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
    field += edges[i].change;
    energy += std::norm(field) * (edges[i + 1].at_m - edges[i].at_m);
  }
  return scatter::to_db(energy / cell_m * std::pow(sonar.frequency_hz / 1500.0, 2.0));
}

}  // namespace

TEST_CASE("two glints interfere as far as their pulses overlap in time, whatever the bins") {
  // Upright plates, one farther than the other. Far from both, which are no wider than a zone,
  // their nearest places are as far aside.
  constexpr double frequency_hz = 100e3, wavelength_m = 1500.0 / frequency_hz, range_m = 20.0;
  const auto plates = [](std::optional<double> one_m, std::optional<double> other_m) {
    refine::TriangleMesh mesh;
    const auto add = [&](double farther_m, double from_m) {
      const auto first = mesh.positions.size();
      add_upright(mesh, {{{from_m, 0.0}, {from_m + 0.05, 0.0}, {from_m + 0.05, 0.05}}});
      add_upright(mesh, {{{from_m, 0.0}, {from_m + 0.05, 0.05}, {from_m, 0.05}}});
      for (std::size_t i = first; i < mesh.positions.size(); ++i)
        mesh.positions[i].x() += static_cast<float>(farther_m);
    };
    if (one_m) add(*one_m, -0.1);
    if (other_m) add(*other_m, 0.05);
    return mesh;
  };
  for (const auto& [kind, window] : {std::pair{PulseKind::cw, PulseWindow::none},
                                     {PulseKind::lfm, PulseWindow::none},
                                     {PulseKind::lfm, PulseWindow::hann}})
    for (const int bins_per_cell : {1, 2, 4, 16}) {
      Sonar sonar = wide_sonar(22.0, frequency_hz);
      sonar.pulse = {.kind = kind, .bandwidth_hz = 10e3, .length_s = 0.0, .window = window};
      const double cell_m = 1500.0 / 2.0 / 10e3;
      sonar.bins = static_cast<int>(sonar.range_m / cell_m * bins_per_cell);
      const auto energy = [&](std::optional<double> one_m, std::optional<double> other_m) {
        const EchoLine line = echo_of({plates(one_m, other_m), nothing, 1.0}, sonar, range_m);
        return std::accumulate(line.bins.intensity_mean.begin(), line.bins.intensity_mean.end(),
                               0.0);
      };
      for (const double cells : {0.0, 0.23, 0.5, 0.77, 1.01, 1.5}) {
        const double gap_m = cells * cell_m;
        const double one = energy(0.0, std::nullopt), other = energy(std::nullopt, gap_m);
        // A sum over parts of the band. A Hann window weights their amplitudes by cos^2.
        double overlap = std::max(0.0, 1.0 - cells);
        if (kind == PulseKind::lfm) {
          double sum = 0.0, whole = 0.0;
          for (int i = 0; i < 1000; ++i) {
            const double f = (i + 0.5) / 1000.0 - 0.5;
            const double weight =
                window == PulseWindow::hann ? std::pow(std::cos(std::numbers::pi * f), 4.0) : 1.0;
            sum += weight * std::cos(2.0 * std::numbers::pi * f * cells);
            whole += weight;
          }
          overlap = sum / whole;
        }
        const double cosine = std::cos(4.0 * std::numbers::pi * gap_m / wavelength_m);
        CAPTURE(static_cast<int>(kind), static_cast<int>(window), bins_per_cell, cells, overlap);
        CHECK(energy(0.0, gap_m) / (one + other) ==
              Approx(1.0 + 2.0 * std::sqrt(one * other) / (one + other) * cosine * overlap)
                  .margin(0.02));
      }
    }
}

TEST_CASE("the pieces of an inclined plate with a window interfere as their pulses overlap") {
  // The body spans more range than a pulse. Without regard to time, all its pieces would interfere.
  const refine::TriangleMesh window =
      upright_cells(1.0, [](int i, int k) { return i % 3 == 0 || k % 3 == 0; });
  constexpr double range_m = 40.0;
  for (const double turned_deg : {0.0, 0.3, 3.0, 4.0, 5.0}) {
    const Sonar sonar = wide_sonar(range_m + 3.0, 100e3);
    const Body body{window, nothing, 1.0, turned_deg * degree};
    const double expected_db = kirchhoff_in_time_db(body, sonar, range_m);
    const double got_db = target_strength_db(echo_of(body, sonar, range_m), sonar);
    CAPTURE(turned_deg, expected_db, got_db);
    CHECK(got_db == Approx(expected_db).margin(2.5));
  }
}

TEST_CASE("with speckle the mean intensity of overlapping glints is the expected one in each bin") {
  Sonar sonar = plain_sonar();
  sonar.receiver.noise = false;
  sonar.pulse.bandwidth_hz = 10e3;
  sonar.range_m = 40.0;
  sonar.bins = 1066;  // two per cell
  const std::size_t bins = static_cast<std::size_t>(sonar.bins), bin = 600;
  const auto line_at = [&](double north_m) {
    return level_line(sonar, starboard_sector, {0.0, north_m, -10.0}, 10.0);
  };
  EchoLine expected = line_at(0.0);
  const double level = std::sqrt(double(expected.bins.intensity_mean[bin]));
  SteadyField field(sonar.pulse, 1500.0, sonar.bin_m(), bins);
  const double at_m = (static_cast<double>(bin) + 0.3) * sonar.bin_m();
  field.add(at_m, level);
  field.add(at_m + 0.6 * sonar.pulse.cell_m(1500.0), std::polar(level, 2.5));
  field.write(expected.glint_re, expected.glint_im);
  const auto with_glints = [&](EchoLine line) {
    line.glint_re = expected.glint_re;
    line.glint_im = expected.glint_im;
    for (std::size_t i = 0; i < bins; ++i)
      line.bins.intensity_mean[i] +=
          line.glint_re[i] * line.glint_re[i] + line.glint_im[i] * line.glint_im[i];
    return line;
  };
  const SignalChain chain(sonar, {});
  SignalChain::Scratch scratch;
  constexpr int pings = 1500;
  std::vector<double> mean(bins);
  EchoLine line;
  for (int i = 0; i < pings; ++i) {
    const double north_m = 7.0 * i;
    line = with_glints(line_at(north_m));
    receive_lines(chain,
                  {.ping = static_cast<std::uint64_t>(i),
                   .array = {{0.0, north_m, -10.0}, {0, 1, 0}},
                   .altitude_m = 10.0},
                  std::span(&line, 1), scratch);
    for (std::size_t n = 0; n < bins; ++n) mean[n] += double(line.bins.intensity[n]) / pings;
  }
  for (std::size_t n = bin - 2; n < bin + 6; ++n) {
    CAPTURE(n);
    CHECK(mean[n] == Approx(double(line.bins.intensity_mean[n])).epsilon(0.1));
  }
}
