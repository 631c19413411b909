#include <cmath>
#include <string>
#include <vector>

#include "support/catch.h"
#include "support/parsed_scene.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/scene/checks/check.h>
#include <ensonify/engine/sonar/instrument/presets.h>

using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

const std::string ahead = head + "[sonar.ahead]\nkind = \"imaging\"\n";

}  // namespace

TEST_CASE("An imaging sonar has the defaults of its kind, and the kind of its preset") {
  const Sonar sonar = parsed(ahead).sonars[0];
  CHECK(sonar.frequency_hz == usual_sonar(SonarKind::imaging).frequency_hz);
  CHECK(sonar.beams == 256);
  CHECK(sonar.bearing_rad(0) == Approx(-65.0 * degree));
  CHECK(sonar.bearing_rad(255) == Approx(65.0 * degree));
  CHECK(sonar.sectors().size() == 1);
  CHECK(sonar.sectors()[0].name == "ahead");
  const Scene gemini = parsed(head + "[sonar.g]\npreset = \"gemini-720is\"\n");
  CHECK(gemini.sonars[0].kind == SonarKind::imaging);
  CHECK(gemini.sonars[0].vertical.tilt_rad == Approx(10.0 * degree));
  CHECK(gemini.motion.crab_rad == 0.0);  // conditions are those of a survey for sidescans only
  CHECK(parsed(head + "[sonar.s]\nrange_m = 50\n").sonars[0].kind == SonarKind::sidescan);
  // Even steps of the sine: the beam at three quarters.
  Sonar by_sine = sonar;
  by_sine.beams = 257;
  by_sine.beam_steps = BeamSteps::sine;
  CHECK(std::sin(by_sine.bearing_rad(192)) == Approx(0.5 * std::sin(65.0 * degree)));
}

TEST_CASE("What a kind of sonar cannot do is refused, with the key and the kind") {
  struct Case {
    std::string text;
    std::vector<std::string> words;
  };
  const auto [text, words] = GENERATE(values<Case>({
      {ahead + "[output]\nxtf = true", {"'output.xtf'", "sonar ahead", "imaging"}},
      {ahead + "[output]\njsf = true", {"'output.jsf'", "sonar ahead", "imaging"}},
      {ahead + "[display]\nslant_range_correction = true",
       {"'display.slant_range_correction'", "sonar ahead", "imaging"}},
      {ahead + "beams = 10000", {"s.toml:4:9", "'sonar.ahead.beams'", "1 to 1024"}},
      {ahead + "field_of_view_deg = 181", {"'sonar.ahead.field_of_view_deg'", "1 to 180"}},
      {ahead + "field_of_view_deg = 0", {"'sonar.ahead.field_of_view_deg'", "1 to 180"}},
      {ahead + "beams = 0", {"'sonar.ahead.beams'", "1 to 1024"}},
      {ahead + "planes = 3", {"'sonar.ahead.planes'", "even"}},
      {ahead + "receive_array_length_m = 0.001",
       {"'sonar.ahead.receive_array_length_m'", "a wavelength or more"}},
      {ahead + "focus_zones_m = [5]", {"'sonar.ahead.focus_zones_m'", "sonar.ahead.focused"}},
      {ahead + "[sonar.s]\n[output]\nxtf = true", {"'output.xtf'", "sonar ahead", "imaging"}},
      {ahead + "[display]\nspeed_correction = true",
       {"'display.speed_correction'", "sonar ahead", "imaging"}},
      {ahead + "preset = \"klein-5000\"",
       {"s.toml:3:8", "'sonar.ahead.kind' is imaging", "preset klein-5000", "another kind"}},
      {head + "[sonar.s]\nkind = \"sidescan\"\npreset = \"gemini-720is\"",
       {"'sonar.s.kind' is sidescan", "preset gemini-720is", "another kind"}},
      {head + "[sonar.s]\nbeams = 33", {"'sonar.s.beams'", "33", "at most 32"}},
      {ahead + "array_length_m = 0.001", {"'sonar.ahead.array_length_m'", "a wavelength or more"}},
      {ahead + "planes = 1024\nelevations = 1000000\narray_length_m = 10",
       {"planes of 1000000 elevations", "rays", "at most"}},
  }));
  const std::string error = error_of(text);
  CAPTURE(text, error);
  for (const std::string& word : words) CHECK(error.find(word) != error.npos);
}

TEST_CASE("Keys of the other kind have no effect, and a scene says so") {
  for (const char* key : {"sides = \"port\"", "beam_spacing_m = 0.1", "port_mount_deg = 5"}) {
    const auto warnings = parsed(ahead + key).warnings;
    CAPTURE(key);
    REQUIRE(warnings.size() == 1);
    CHECK(warnings[0].find("has no effect with kind = \"imaging\"") != std::string::npos);
  }
  for (const char* key :
       {"field_of_view_deg = 90", "beam_steps = \"sine\"", "transmit_beamwidth_deg = 30"}) {
    const auto warnings = parsed(head + "[sonar.s]\n" + key).warnings;
    CAPTURE(key);
    REQUIRE(warnings.size() == 1);
    CHECK(warnings[0].find("has no effect with kind = \"sidescan\"") != std::string::npos);
  }
}

TEST_CASE("What is made of sidescans names a sonar that is none") {
  CHECK_NOTHROW(require_sidescans(parsed(head), "a dataset"));
  CHECK(error_of([] { require_sidescans(parsed(ahead), "a dataset"); }) ==
        "'sonar.ahead.kind' is \"imaging\", but a dataset can have sidescans only");
}
