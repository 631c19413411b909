#include <string>
#include <vector>

#include <ensonify/engine/scene/dump.h>
#include <ensonify/engine/scene/reader.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/temporary_folder.h"

using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

const std::string plain = R"(version = 1
[sonar.s]
[material.m]
like = "medium sand"
[[objects]]
shape = "box"
[[seafloor.patches]]
material = "m"
)";

/// Keys that change nothing in a scene with these overrides before them.
struct Unused {
  std::vector<std::string> before, keys;
};

}  // namespace

TEST_CASE("A key that another key makes useless is warned of, with its place") {
  CHECK(parse_scene(plain, "s.toml").warnings.empty());
  for (const Unused& unused : std::vector<Unused>{
           {{},
            {"sea.volume_scattering_db=-60", "seafloor.survey_cell_m=2",
             "seafloor.uncertainty_scatter=1", "seafloor.detail.hurst=0.4",
             "seafloor.water_level_m=1", "seafloor.weld_m=0.1", "seafloor.ripples.wavelength_m=2",
             "seafloor.ripples.hurst=1.5", "seafloor.downhill_deg=30"}},
           {{},
            {"track.legs=3", "track.leg_length_m=10", "track.ping_in_turns=false",
             "track.smooth_s=2", "track.climb_mps=2"}},
           {{"track.kind=lawn-mower"}, {"track.pings=7", "track.follow_s=1"}},
           {{"conditions=ideal"},
            {"motion.roll.period_s=3", "motion.speed.wander_s=9", "arrivals.bottom_loss_db=3",
             "arrivals.wall_loss_db=3"}},
           {{},
            {"artefacts.stale_s=2", "artefacts.interference_length_m=1", "artefacts.gain_step_s=2",
             "artefacts.automatic_gain_m=2", "artefacts.fish_height_m=2",
             "artefacts.wake_width_m=2", "artefacts.shimmer_m=2"}},
           {{"display.mapping=equalised"},
            {"display.gain_db=20", "display.gamma=0.6", "display.range_db=40"}},
           {{"output.exr=false"},
            {"output.exr_compression=zip", "output.one_recording=true",
             "output.layers=[\"intensity\"]"}},
           {{"sonar.s.pulse=cw"},
            {"sonar.s.window=hann", "sonar.s.shading_side_lobe_db=-40", "sonar.s.taylor_nbar=6",
             "sonar.s.beam_spacing_m=0.1", "sonar.s.vertical_ripple_dark_deg=10",
             "sonar.s.self_noise_slope_db=50", "sonar.s.curve_range_db=60"}},
           {{"sonar.s.pulse_length_s=1e-4"}, {"sonar.s.bandwidth_hz=50000"}},
           {{},
            {"material.m.lambert_mu_db=-20", "material.m.specular=0.1",
             "material.m.gsab_lambert_db=-20"}},
           {{"material.m.model=lambert"},
            {"material.m.volume=0.01", "material.m.density_ratio=1.5", "material.m.loss=0.01"}},
           {{"material.m.model=solid", "material.m.like=steel"},
            {"material.m.mean_grain_size_phi=2", "material.m.sound_speed_ratio=1.1",
             "material.m.density_ratio=1.5", "material.m.loss=0.01"}},
           {{"texture=false"}, {"material.m.texture_shape=2", "material.m.variation_db=1"}},
           {{"speckle=false"}, {"material.m.glint_share=0.1", "material.m.texture_patch_m=2"}},
           {{"texture=false", "material.m.model=lambert"},
            {"material.m.mean_grain_size_phi=2", "material.m.sound_speed_ratio=1.1"}},
           {{},
            {"objects.0.current_deg=20", "objects.0.burial_scale_m=3",
             "objects.0.part_classes=true", "seafloor.patches.0.middle_east_m=5",
             "seafloor.patches.0.image_value=2", "seafloor.patches.0.patch_m=9",
             "seafloor.patches.0.ragged_m=1"}}}) {
    std::vector<std::string> overrides = unused.before;
    CHECK(parse_scene(plain, "s.toml", overrides).warnings.empty());
    for (const std::string& key : unused.keys) {
      overrides.push_back(key);
      const auto warnings = parse_scene(plain, "s.toml", overrides).warnings;
      CAPTURE(key);
      REQUIRE(warnings.size() == 1);
      CHECK(warnings[0].starts_with("-D " + key + ": '" + key.substr(0, key.find('=')) +
                                    "' has no effect "));
      overrides.pop_back();
    }
  }
  const Scene scene = parse_scene(plain + "[artefacts]\nwake_width_m = 4\n", "s.toml");
  REQUIRE(scene.warnings.size() == 1);
  CHECK(scene.warnings[0] ==
        "s.toml:10:16: 'artefacts.wake_width_m' has no effect without 'artefacts.wake_db'");
}

TEST_CASE("An analysed seabed has its own material and water level") {
  const TemporaryFolder folder;
  write_text(folder / "bed.pm", "");  // it is not read yet
  const std::string text = R"(version = 1
[seafloor]
kind = "progressive"
progressive = "bed.pm"
[sonar.s]
)";
  const ScenePaths paths{.scene_folder = folder.path()};
  CHECK(parse_scene(text, "s.toml", {}, paths).warnings.empty());
  for (const std::string key : {"seafloor.material=sandy mud", "seafloor.water_level_m=1"}) {
    const auto warnings = parse_scene(text, "s.toml", std::vector{key}, paths).warnings;
    REQUIRE(warnings.size() == 1);
    CHECK(warnings[0] == "-D " + key + ": '" + key.substr(0, key.find('=')) +
                             "' has no effect on a seabed that was analysed, which has its own");
  }
}

TEST_CASE("Keys that do something, and the usual values, are not warned of") {
  const std::vector<std::string> used{"seafloor.ripples.rms_height_m=0.1",
                                      "seafloor.ripples.wavelength_m=2",
                                      "track.kind=lawn-mower",
                                      "track.legs=3",
                                      "track.vertical=altitude",
                                      "track.climb_mps=2",
                                      "artefacts.fish_per_hectare=5",
                                      "artefacts.fish_height_m=2",
                                      "sonar.s.pulse=lfm",
                                      "sonar.s.window=hann",
                                      "sonar.s.pulse_length_s=1e-3",
                                      "sonar.s.bandwidth_hz=20000",
                                      "objects.0.scour_ratio=0.2",
                                      "objects.0.current_deg=20",
                                      "seafloor.patches.0.share=0.5",
                                      "seafloor.patches.0.patch_m=9"};
  const Scene scene = parse_scene(plain, "s.toml", used);
  CHECK(scene.warnings.empty());
  for (const std::vector<std::string>& overrides :
       {// The texture is that of the sediment.
        std::vector<std::string>{"material.m.model=lambert", "material.m.mean_grain_size_phi=2",
                                 "material.m.sound_speed_ratio=1.1"},
        {"texture=false", "material.m.mean_grain_size_phi=2", "material.m.density_ratio=1.5",
         "material.m.sound_speed_ratio=1.1", "material.m.loss=0.01"},
        {"objects.0.shape=wreck", "objects.0.part_classes=true"},
        {"objects.0.assembly=a", "objects.0.part_classes=true"},
        {"output.exr=false", "output.npz=true", "output.layers=[\"intensity\"]"}}) {
    CAPTURE(overrides);
    CHECK(parse_scene(plain, "s.toml", overrides).warnings.empty());
  }
  CHECK(parse_scene(dump_scene(scene), "whole.toml").warnings.empty());
}
