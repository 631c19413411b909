// What is wrong in a scene is named with its place, what was expected and a suggestion.

#include "support/catch.h"
#include "support/parsed_scene.h"

using namespace ensonify::engine;
using ensonify::tests::error_of;
using ensonify::tests::head;

TEST_CASE("Each kind of error names its place, what was expected and a suggestion") {
  struct Case {
    std::string text, message;
  };
  const auto [text, message] = GENERATE(values<Case>({
      {"", "s.toml:1:1: no 'version', expected version = 1 at the top"},
      {"version = 2", "s.toml:1:11: 'version' is 2, expected 1, the only version"},
      {"version = \"1\"",
       "s.toml:1:11: 'version' is the string \"1\", expected 1, the only version"},
      {head + "sede = 3", "s.toml:2:1: unknown key \"sede\"; did you mean 'seed'?"},
      {head + "[sonar.a]\nrng = 3",
       "s.toml:3:1: unknown key \"rng\" in [sonar.a]; did you mean 'range_m'?"},
      {head + "[sae]", "s.toml:2:2: unknown key \"sae\"; did you mean 'sea'?"},
      {head + "[seafloor.ripple]\nhurst = 0.5",
       "s.toml:2:11: unknown key \"ripple\" in [seafloor]; did you mean 'ripples'?"},
      {head + "[sonar.a]\nfrequency_khz = 5",
       "s.toml:3:1: unknown key \"frequency_khz\" in [sonar.a]; did you mean 'frequency_hz'?"},
      {head + "[sonar.a]\nfrequency = 5",
       "s.toml:3:1: unknown key \"frequency\" in [sonar.a]; did you mean 'frequency_hz'?"},
      {head + "[track]\naltitude = 5",
       "s.toml:3:1: unknown key \"altitude\" in [track]; did you mean 'altitude_m'?"},
      {head + "range_m = 5",
       "s.toml:2:1: unknown key \"range_m\"; did you mean 'sonar.NAME.range_m'?"},
      {head + "[display]\nzzzzzzzzzz = 5",
       "s.toml:3:1: unknown key \"zzzzzzzzzz\" in [display]; expected one of of, spreading, "
       "absorption, slant_range_correction, speed_correction, column_value, beam_normalisation, "
       "flat_field, gain_db, mapping, gamma, range_db, smoothing_px, track_smoothing_px, palette"},
      {head + "\"sea.temperature_c\" = 5",
       "s.toml:2:1: unknown key \"sea.temperature_c\"; did you mean 'sea.temperature_c'?"},
      {head + "[output]\nclass_names = [\"none\"]",
       "s.toml:3:15: 'output.class_names' names \"none\", which is the name of number 0: leave it out"},
      {head + "[[objects]]\nshape = \"box\"\nclass = \"none\"",
       "s.toml:4:9: 'objects.0.class' is \"none\", which is the name of number 0: expected another name"},
      {head + "[material.none]\nlike = \"steel\"\nmodel = \"solid\"",
       "s.toml:2:11: a material is named \"none\", which is the name of number 0: expected another name"},
      {head + "[sonar.a]\nrange_m = 50\nsample_rate_hz = 10",
       "s.toml:4:18: 'sonar.a.sample_rate_hz' is 10 and makes bins of 74.5 m, longer than range_m, "
       "which is 50; expected at least 14.9 Hz"},
      {head + "sea = 3", "s.toml:2:7: 'sea' is 3, expected a table, [sea]"},
      {head + "sonar = 3", "s.toml:2:9: 'sonar.NAME' is 3, expected a table, [sonar.NAME]"},
      {head + "sonar = {}", "s.toml:2:9: 'sonar' is empty, expected [sonar.NAME]"},
      {head + "[[sonar]]\nbins = 3",
       "s.toml:2:1: 'sonar.NAME' is an array, expected a table, [sonar.NAME]"},
      {head + "[sonar]\nbins = 3",
       "s.toml:3:1: 'sonar.bins' does not say which sonar, expected sonar.NAME.bins, in a table "
       "[sonar.NAME]"},
      {head + "[sonar]\nbin = 3", "s.toml:3:7: 'sonar.bin' is 3, expected a table, [sonar.bin]"},
      {head + "[material]\nlike = \"rock\"",
       "s.toml:3:1: 'material.like' does not say which material, expected material.NAME.like, in a "
       "table [material.NAME]"},
      {head + "[track]\norigin = 3",
       "s.toml:3:1: unknown key \"origin\" in [track]; did you mean 'origin_lat_deg' or "
       "'origin_lon_deg'?"},
      {head + "[seafloor]\nmaterial = \"clayey\"",
       "s.toml:3:12: 'seafloor.material': material 'clayey' is not known; the nearest names are "
       "'clayey sand' (a sediment) and 'clayey silt' (a sediment); covers are seagrass, shells; solids are steel, "
       "fouled steel, aluminium, "
       "concrete, stone, wood, glass fibre, rubber, fouled rubber; or describe one in a table [material.NAME]"},
      {head + "[seafloor]\nmaterial = \"x\"\n[material.x]\nlike = \"steel\"",
       "s.toml:3:12: 'seafloor.material': like = \"steel\" is a solid; model = \"tr9407\" is for "
       "sediments, a solid needs model = \"solid\", a cover model = \"lambert\" and "
       "lambert_mu_db"},
      {head + "[sonar.\"a/b\"]",
       "s.toml:2:8: the sonar's name is \"a/b\", expected 1 to 64 letters, digits, _ and -"},
      {head + "[sonar.a]\n[sonar.a_ground]\n",
       "s.toml:3:8: a sonar named \"a_ground\" would have files of the same name as the sonar a; give "
       "it another name"},
      {head + "[sonar.a]\n[sonar.a_background]\n",
       "s.toml:3:8: a sonar named \"a_background\" would have files of the same name as the sonar a; "
       "give it another name"},
      {head + "[sonar.sample]\n",
       "s.toml:2:8: a sonar named \"sample\" would have files of the same name as sample.json; give "
       "it another name"},
      {head + "seed = -1",
       "s.toml:2:8: 'seed' is -1, expected a whole number from 0 to 9223372036854775807"},
      {head + "speckle = 1", "s.toml:2:11: 'speckle' is 1, expected true or false"},
      {head + "[artefacts]\nlost = { uniform = [0, 1] }\n[dataset]\nsamples = 2",
       "s.toml:4:2: this is a dataset's recipe, expected a scene: `ensonify generate` takes it"},
      {head + "[arrivals]\nburst_m = { times = \"draw.a\" }\n[draw]\na = 2",
       "s.toml:4:2: this is a dataset's recipe, expected a scene: `ensonify generate` takes it"},
      {head + "[track]\n  pings = 7.0",
       "s.toml:3:11: 'track.pings' is 7.0, expected a whole number from 1 to 10000000"},
      {head + "[track]\nspeed_mps = true",
       "s.toml:3:13: 'track.speed_mps' is true, expected a number from 0 to 50 m/s"},
      {head + "[track]\nspeed_mps = \"2\"",
       "s.toml:3:13: 'track.speed_mps' is the string \"2\", expected a number from 0 to 50 m/s"},
      {head + "[track]\nspeed_mps = [2]",
       "s.toml:3:13: 'track.speed_mps' is an array, expected a number from 0 to 50 m/s"},
      {head + "[track]\nspeed_mps = 2024-01-01",
       "s.toml:3:13: 'track.speed_mps' is a date or a time, expected a number from 0 to 50 m/s"},
      {head + "[track]\nspeed_mps = nan",
       "s.toml:3:13: 'track.speed_mps' is nan, expected a number from 0 to 50 m/s"},
      {head + "[track]\nspeed_mps = -inf",
       "s.toml:3:13: 'track.speed_mps' is -inf, expected a number from 0 to 50 m/s"},
      {head + "[track]\nheading_deg = 361",
       "s.toml:3:15: 'track.heading_deg' is 361, expected a number from -360 to 360 degrees"},
      {head + "[display]\npalette = \"gray\"",
       "s.toml:3:11: 'display.palette' is the string \"gray\", expected one of grey, copper, "
       "bronze, paper, viridis; did you "
       "mean 'grey'?"},
      {head + "[run]\nsurface = \"refine\"",
       "s.toml:3:11: 'run.surface' is the string \"refine\", expected one of auto, static, "
       "refined, "
       "footprint; did you mean 'refined'?"},
      // What keys say of each other.
      {head + "[seafloor]\nkind = \"survey\"",
       "s.toml:3:8: 'seafloor.kind' is \"survey\", but no survey is named: give its file as "
       "seafloor.survey"},
      {head + "[seafloor]\nsurvey = \"a.tif\"",
       "s.toml:3:10: 'seafloor.survey' needs seafloor.kind = \"survey\""},
      {head + "[seafloor]\nkind = \"survey\"\nripples.rms_height_m = 0.1",
       "s.toml:4:24: 'seafloor.ripples' needs seafloor.kind = \"fractal\"; on a survey, ripples are "
       "a layer [[seafloor.crests]]"},
      {head + "[seafloor]\nkind = \"mesh\"",
       "s.toml:3:8: 'seafloor.kind' is \"mesh\", but no mesh is named: give its file as "
       "seafloor.mesh"},
      {head + "[[objects]]\nmesh = \"a.ply\"\n[[objects]]\neast_m = 1",
       "s.toml:4:1: 'objects.1' has no mesh: give its file as mesh = \"...\", or a shape = \"...\" "
       "by "
       "name"},
      {head + "[objects]\nmesh = \"a.ply\"",
       "s.toml:2:1: 'objects' is a table, expected tables, [[objects]]"},
      {head + "objects = [1]", "s.toml:2:12: '[objects]' is 1, expected a table, [[objects]]"},
      {head + "[[objects]]\nmesh = \"a.ply\"\nhight_m = 1",
       "s.toml:4:1: unknown key \"hight_m\" in [objects.0]; did you mean 'height_m'?"},
      {head + "[[objects]]\nmesh = \"a.ply\"\nscale = 0",
       "s.toml:4:9: 'objects.0.scale' is 0, expected a number from 1e-06 to 1000000"},
      {head + "[seafloor]\nmaterial = \"medium sant\"",
       "s.toml:3:12: 'seafloor.material': material 'medium sant' is not known; the nearest names "
       "are 'medium sand' (a sediment), 'medium silt' (a sediment) and 'muddy sand' (a sediment); "
       "covers are seagrass, shells; solids are "
       "steel, fouled steel, aluminium, concrete, "
       "stone, "
       "wood, glass fibre, rubber, fouled rubber; or describe one in a table [material.NAME]"},
      {head + "[material.a]\nlike = \"seagrass\"\nmodel = \"solid\"",
       "s.toml:3:8: 'material.a.like': like = \"seagrass\" is a cover; model = \"solid\" is for "
       "solids: steel, fouled steel, aluminium, "
       "concrete, stone, wood, glass fibre, rubber, fouled rubber"},
      {head + "[material.a]\nspecular = 1\nlike = \"steel\"\nmodel = \"solid\"",
       "s.toml:4:8: 'material.a.like': solid: diffuse_db = -30 and specular = 1 scatter more "
       "energy than arrives: pi 10^(diffuse_db/10) + specular is 1.003, expected at most 1"},
      {head + "[sonar.a]\nsector_low_deg = 140",
       "s.toml: 'sonar.a.sector_high_deg' is 132, expected more than sector_low_deg, which is 140"},
      {head + "[sonar.a]\nvertical_beamwidth_deg = 0.1",
       "s.toml:3:26: 'sonar.a.vertical_beamwidth_deg' is 0.1, expected 0 (the same in all "
       "directions) or at least 0.5: a narrower beam is finer than the simulator's table of "
       "directions"},
      {head + "[sonar.a]\nplanes = 7",
       "s.toml:3:10: 'sonar.a.planes' is 7, expected an even number"},
      {head + "[sonar.a]\nsector_low_deg = -60\nsector_high_deg = 120",
       "s.toml:4:19: 'sonar.a.sector_high_deg' is 120, expected less than 180 degrees above "
       "sector_low_deg, which is -60"},
      {head + "[sea]\nsound_speed_mps=1500\n[sonar.a]\narray_length_m = 0.003",
       "s.toml:5:18: 'sonar.a.array_length_m' is 0.003, expected a wavelength or more, 0.00375 m "
       "at "
       "400000 Hz"},
      {head + "[sonar.a]\nshading = \"taylor\"\nshading_side_lobe_db = -40",
       "s.toml: 'sonar.a.taylor_nbar': Taylor's side lobes of -40 dB need an nbar of 6 or more, and "
       "it is 4"},
      {head + "[sonar.a]\nreceive_shading = \"weights\"\nreceive_shading_weights = [1, 2]",
       "s.toml:4:27: 'sonar.a.receive_shading_weights': weight 1 is 1 from one end and 2 from the "
       "other, expected the same"},
      {head + "[sonar.a]\nshading_weights = [1, 1]",
       "s.toml:3:19: 'sonar.a.shading_weights' needs shading = \"weights\""},
      {head + "[sonar.a]\nfocused = true\nfocus_zones_m = [10]",
       "s.toml:4:17: 'sonar.a.focus_zones_m' is given, and sonar.a.focused is true: the arrays are "
       "focused either in zones or at all ranges, leave one out"},
      {head + "[sonar.a]\nbandwidth_hz = 500e3",
       "s.toml:3:16: 'sonar.a.bandwidth_hz' is 500000, expected at most frequency_hz, which is "
       "400000"},
      {head +
           "[artefacts]\ninterference_db = 40\ninterference_range_m = 100\n[sonar.a]\nrange_m = 75",
       "s.toml:4:24: 'artefacts.interference_range_m' is 100, expected less than the range of a "
       "sonar, of which the longest is 75 m"},
      {head + "[seafloor]\ncell_m = 0.001",
       "s.toml:3:10: a seabed of 200 x 140 m in cells of 0.001 m has 2.8e+10 points, expected at "
       "most 1.07e+09: make the cells larger or the seabed smaller"},
      {head + "[seafloor.ripples]\nrms_height_m = 0.1\nwavelength_m = 0.5",
       "s.toml:4:16: ripples of 0.5 m need cells of 0.125 m or less, and seafloor.cell_m is 0.2"},
      {head + "[track]\npings = 1_000_000",
       "s.toml:3:9: 1000000 pings make 3e+09 pixels, expected at most 1e+09: use fewer pings or "
       "bins"},
  }));
  CHECK(error_of(text) == message);
}

TEST_CASE("Options of a track that do not fit each other are refused") {
  CHECK(error_of(head + "[track]\nkind = \"file\"") ==
        "s.toml:3:8: 'track.kind' is \"file\", but no file is named: give it as track.file");
  CHECK(error_of(head + "[track]\nfile = \"a.csv\"") ==
        "s.toml:3:8: 'track.file' needs track.kind = \"file\"");
  CHECK(error_of(head + "[track]\norigin_lat_deg = 50").starts_with("s.toml:3:18: of "));
  CHECK(error_of(head + "[track]\nkind = \"lawn-mower\"\nspeed_mps = 0")
            .starts_with("s.toml:4:13: 'track.speed_mps' is 0, "));
}
