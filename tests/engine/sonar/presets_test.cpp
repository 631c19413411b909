#include <ensonify/engine/sonar/instrument/presets.h>

#include <cmath>
#include <fstream>
#include <set>
#include <string>

#include <fmt/format.h>

#include "support/catch.h"
#include "support/paths.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/sonar/instrument/beam_pattern.h>
#include <ensonify/engine/sonar/reception/signal_chain.h>
#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/sea_water.h>

using namespace ensonify;
using namespace ensonify::engine;
using scatter::to_db;

namespace {

/// The echo of level medium sand over the noise, after the matched filter, at an altitude of a
/// tenth of the range, in the default sea.
class SandEcho {
 public:
  explicit SandEcho(const Sonar& sonar)
      : altitude_m_(0.1 * sonar.range_m),
        sound_speed_mps_(scatter::sound_speed_mps({}, altitude_m_)),
        scatterers_(sonar, sound_speed_mps_, 1, 0.0, {}, 10.0 * sonar.range_m),
        law_(sonar, sound_speed_mps_,
             scatter::absorption_db_per_m({}, altitude_m_, sonar.frequency_hz), scatterers_),
        sand_(scatter::sediment_named("medium sand"), sonar.frequency_hz, sound_speed_mps_),
        noise_(SignalChain(sonar, {.sound_speed_mps = sound_speed_mps_}).noise(1)) {}

  double over_noise_db(double range_m) const {
    const double sine = altitude_m_ / range_m;
    return to_db(law_.level_bed(BeamPlane(1), range_m, sine) *
                 sand_.cross_section(std::asin(sine)) / noise_);
  }
  /// The farthest range at which it is as strong as the noise.
  double reach_m() const {
    double range_m = 100.0 * altitude_m_;
    while (over_noise_db(range_m) < 0.0) range_m *= 0.999;
    return range_m;
  }

 private:
  double altitude_m_, sound_speed_mps_;
  Scatterers scatterers_;
  SonarEquation law_;
  scatter::Bottom sand_;
  double noise_;
};

}  // namespace

TEST_CASE("a preset's array length gives its beamwidth") {
  std::set<std::string_view> names;
  for (const Preset& preset : presets()) {
    CAPTURE(preset.name);
    CHECK(names.insert(preset.name).second);
    CHECK(preset.sonar.preset == preset.name);
    const LineArray array{preset.sonar.receive_length_m(), 1500.0 / preset.sonar.frequency_hz};
    CHECK(array.power(std::sin(0.5 * preset.beamwidth_rad)) == Approx(0.5).epsilon(0.01));
    // The bins are as fine as the pulse's resolution, with at most a hundred bins more.
    const Pulse& pulse = preset.sonar.pulse;
    const double resolution_m =
        pulse.kind == PulseKind::cw ? 750.0 * pulse.length_s : 750.0 / pulse.bandwidth_hz;
    CHECK(preset.sonar.bin_m() <= resolution_m * (1.0 + 1e-12));
    CHECK(preset.sonar.range_m / resolution_m > preset.sonar.bins - 100);
  }
  CHECK(names.size() > 15);
  CHECK_THROWS_WITH(preset_sonar("klein"), Catch::Contains("klein-5000"));
}

TEST_CASE("the chirps of presets are longer than 1 / B, and their makers' other pulses are tones") {
  for (const Preset& preset : presets()) {
    if (preset.sonar.steers()) continue;
    const Pulse& pulse = preset.sonar.pulse;
    CAPTURE(preset.name);
    const bool chirp = preset.name.starts_with("edgetech") || preset.name.starts_with("deepvision");
    CHECK((pulse.kind == PulseKind::lfm) == chirp);
    if (chirp) CHECK(pulse.length_s * pulse.bandwidth_hz > 50.0);
  }
}

TEST_CASE(
    "every sidescan's preset reaches about its range over medium sand, as the page of presets says") {
  std::string page;
  {
    std::ifstream file(tests::source_folder() / "engine/sonar/instrument/presets.md");
    page.assign(std::istreambuf_iterator<char>(file), {});
  }
  std::size_t rows = 0;
  for (const Preset& preset : presets()) {
    const Sonar& sonar = preset.sonar;
    if (sonar.steers()) {
      const std::string row = fmt::format(
          "| {} | {:g} | {:g} | {} | {:g} | {:g} | {:g} |", preset.name, 1e-3 * sonar.frequency_hz,
          sonar.field_of_view_rad / degree, sonar.beams, preset.beamwidth_rad / degree,
          sonar.vertical.beamwidth_rad / degree, sonar.range_m);
      CAPTURE(row);
      CHECK(page.find(row) != std::string::npos);
      ++rows;
      continue;
    }
    const Pulse& pulse = sonar.pulse;
    const SandEcho echo(sonar);
    const double reach_m = echo.reach_m();
    const std::string row = fmt::format(
        "| {} | {} | {:g} | {:g} | {:.1f} | {:g} | {:g} | {:.0f} | {:.2f} | {:.0f} | {:.0f} |",
        preset.name, pulse.kind == PulseKind::lfm ? "lfm" : "cw", 1e3 * pulse.length_s,
        1e-3 * pulse.bandwidth_hz,
        pulse.kind == PulseKind::lfm ? to_db(pulse.length_s * pulse.bandwidth_hz) : 0.0,
        sonar.source_level_db, sonar.range_m, reach_m, reach_m / sonar.range_m,
        std::round(echo.over_noise_db(0.5 * sonar.range_m)),
        std::round(echo.over_noise_db(sonar.range_m)) + 0.0);  // no -0
    CAPTURE(row);
    CHECK(reach_m > 0.8 * sonar.range_m);
    CHECK(reach_m < 1.4 * sonar.range_m);
    CHECK(page.find(row) != std::string::npos);
    ++rows;
  }
  CHECK(rows == presets().size());
}
