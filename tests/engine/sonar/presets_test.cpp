#include <ensonify/engine/sonar/instrument/presets.h>

#include <cmath>
#include <set>

#include "support/catch.h"

#include <ensonify/engine/sonar/instrument/beam_pattern.h>

using namespace ensonify::engine;

TEST_CASE("a preset's array length gives its beamwidth") {
  std::set<std::string_view> names;
  for (const Preset& preset : presets()) {
    CAPTURE(preset.name);
    CHECK(names.insert(preset.name).second);
    CHECK(preset.sonar.preset == preset.name);
    const LineArray array{preset.sonar.array_length_m, 1500.0 / preset.sonar.frequency_hz};
    CHECK(array.power(std::sin(0.5 * preset.beamwidth_rad)) == Approx(0.5).epsilon(0.01));
    // The bins are as fine as the pulse's resolution, with at most a hundred bins more.
    const double resolution_m = 750.0 / preset.sonar.pulse.bandwidth_hz;
    CHECK(preset.sonar.bin_m() <= resolution_m);
    CHECK(preset.sonar.range_m / resolution_m > preset.sonar.bins - 100);
  }
  CHECK(names.size() > 15);
  CHECK_THROWS_WITH(preset_sonar("klein"), Catch::Contains("klein-5000"));
}
