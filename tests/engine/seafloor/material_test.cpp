#include <ensonify/engine/seafloor/material.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "support/catch.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/scatter/composite_roughness.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/ground_texture.h>
#include <ensonify/scatter/solid_target.h>
#include <ensonify/scatter/strength_table.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

double strength_db(const Material& material, double grazing_deg, double relief_spacing_m = 0.0) {
  return scatter::to_db(backscatter_of(material, 100e3, 1500.0, relief_spacing_m)
                            ->cross_section(grazing_deg * degree));
}

}  // namespace

TEST_CASE("The scene's own material takes precedence over a sediment or solid of the same name") {
  CHECK(material_named("medium sand", {}).model == "tr9407");
  CHECK(material_named("steel", {}).model == "solid");
  const std::vector<Material> own{{.name = "steel", .model = "lambert"}};
  CHECK(material_named("steel", own).model == "lambert");
  CHECK_THROWS_WITH(material_named("stel", own),
                    Catch::Contains("material 'stel' is not known") &&
                        Catch::Contains("names are 'steel' (of this scene)") &&
                        Catch::Contains("solids are steel, fouled steel") &&
                        Catch::Contains("[material.NAME]"));
}

TEST_CASE("an unknown name of a material is answered with the nearest names of all lists") {
  CHECK_THROWS_WITH(material_named("stel", {}), Catch::Contains("names are 'steel' (a solid)"));
  CHECK_THROWS_WITH(material_named("seagras", {}), Catch::Contains("'seagrass' (a cover)"));
  const auto refused = [](const char* model, const char* like, const std::string& message) {
    CHECK_THROWS_WITH(strength_db({.model = model, .like = like}, 20.0), Catch::Contains(message));
  };
  refused("solid", "medium sand", "like = \"medium sand\" is a sediment; model = \"solid\"");
  refused("solid", "seagrass", "is a cover; model = \"solid\" is for solids: steel, fouled steel");
  refused("solid", "stel", "is not known; the nearest names are 'steel' (a solid)");
  refused("tr9407", "shells", "is a cover; model = \"tr9407\" is for sediments");
}

TEST_CASE(
    "Each model scatters by its own formula, with the parameters that the material overrides") {
  const double grazing_deg = 35.0, g = grazing_deg * degree;
  CHECK(strength_db({.model = "lambert", .lambert_mu_db = -20.0}, grazing_deg) ==
        Approx(scatter::to_db(scatter::Lambert(-20.0).cross_section(g))));
  const scatter::Solid wood = scatter::solid_named("wood");
  CHECK(strength_db({.model = "solid", .like = "wood", .specular = 0.5}, 89.0) ==
        Approx(scatter::to_db(
            scatter::SolidTarget(scatter::Solid{wood.diffuse_db, 0.5, wood.lobe_width_rad}.rough())
                .cross_section(89.0 * degree))));

  scatter::Sediment sand = scatter::sediment_of_grain_size(2.2);
  sand.volume = 0.01;
  sand.strength_offset_db = 3.0;
  const Material material{
      .like = "rock", .mean_grain_size_phi = 2.2, .volume = 0.01, .strength_offset_db = 3.0};
  for (const char* model : {"tr9407", "small-slope"}) {
    Material of_model = material;
    of_model.model = model;
    CHECK(strength_db(of_model, grazing_deg) ==
          Approx(scatter::to_db(scatter::Bottom(sand, 100e3, 1500.0, model).cross_section(g))));
  }
}

TEST_CASE(
    "Relief that the mesh contains is removed from the model's slopes: less shadowing at grazing") {
  const Material sand{.like = "medium sand"};
  const scatter::Sediment sediment = scatter::sediment_named("medium sand");
  const double fraction =
      scatter::resolved_slope_fraction(sediment, scatter::wavenumber_per_cm(100e3, 1500.0), 0.25);
  CHECK(fraction == Approx(0.25).margin(0.02));  // a quarter at 25 cm cells and 100 kHz
  const scatter::Bottom rest(sediment, 100e3, 1500.0, "tr9407", fraction);
  for (const double grazing_deg : {2.0, 10.0, 45.0})
    CHECK(strength_db(sand, grazing_deg, 0.25) ==
          Approx(scatter::to_db(rest.cross_section(grazing_deg * degree))));
  CHECK(strength_db(sand, 2.0, 0.25) != Approx(strength_db(sand, 2.0)).epsilon(1e-4));
}

TEST_CASE("The generic model has the material's levels and widths, and those that it needs") {
  Material shoal{.name = "shoal", .model = "gsab", .gsab_lambert_db = -20.0};
  CHECK(strength_db(shoal, 30.0) ==
        Approx(scatter::to_db(scatter::Lambert(-20.0).cross_section(30.0 * degree))));
  shoal.gsab_specular_db = -3.0;
  CHECK_THROWS_WITH(strength_db(shoal, 30.0),
                    Catch::Contains("gsab_specular_db and gsab_specular_width_deg one is missing"));
  shoal.gsab_specular_width_rad = 4.0 * degree;
  shoal.gsab_transitional_db = -12.0;
  shoal.gsab_transitional_width_rad = 15.0 * degree;
  shoal.strength_offset_db = 1.5;
  const double sum = scatter::from_db(-3.0) * std::exp(-25.0 / 32.0) +
                     scatter::from_db(-20.0) * std::pow(std::cos(5.0 * degree), 2.0) +
                     scatter::from_db(-12.0) * std::exp(-25.0 / 450.0);
  CHECK(strength_db(shoal, 85.0) == Approx(scatter::to_db(sum) + 1.5));
  CHECK(!sediment_of(shoal));
  CHECK_THROWS_WITH(strength_db({.model = "gsab"}, 30.0), Catch::Contains("needs gsab_lambert_db"));
}

TEST_CASE("Rough solids are uneven at all angles, smooth ones are even") {
  const scatter::GroundTexture fouled =
      texture_of({.name = "hull", .model = "solid", .like = "fouled steel"});
  CHECK_FALSE(fouled.even());
  CHECK(fouled.shape_at(0.1) == fouled.shape_at(1.5));
  // The ln intensity of a K distribution has the variance trigamma(1) + trigamma(shape). From ping
  // to ping the samples of the wreck in scotsman-iver2.xtf, where they do not clip, change by 1.33
  // (variance of ln), and the samples of the bed next to the wreck change by 0.88. So the wreck's
  // texture adds at most half of the speckle's variance.
  double trigamma = 0.0;
  for (int n = 0; n < 100'000; ++n) trigamma += std::pow(fouled.shape_at(0.5) + n, -2.0);
  CHECK(trigamma < (1.33 / 0.88 - 1.0) * std::numbers::pi * std::numbers::pi / 6.0);
  CHECK(texture_of({.name = "plate", .model = "solid", .like = "steel"}).even());
  CHECK(texture_of({.name = "hull",
                    .model = "solid",
                    .like = "fouled steel",
                    .texture_shape = 0.0,
                    .variation_db = 0.0})
            .even());
}

TEST_CASE("A material that returns more than arrives is warned of, with angle and decibels") {
  const auto warnings = [](const Material& material, double frequency_hz) {
    return warnings_of(material, *backscatter_of(material, frequency_hz, 1500.0, 0.0),
                       frequency_hz);
  };
  Material bright{.name = "bright", .model = "gsab", .gsab_lambert_db = -2.0};
  const auto too_strong = warnings(bright, 400e3);
  REQUIRE(too_strong.size() == 1);
  CHECK(too_strong[0].starts_with("material bright: at 400 kHz and "));
  CHECK(too_strong[0].find("3.0 dB stronger than any opaque surface") != std::string::npos);
  bright.strength_offset_db = -4.0;
  CHECK(warnings(bright, 400e3).empty());
  CHECK(warnings({.name = "rock", .like = "rock"}, 100e3).empty());
  CHECK(warnings({.name = "old", .like = "handbook rough rock"}, 100e3).size() == 1);
}

TEST_CASE("A table is used with the material's offset, and what it lacks is warned of") {
  Material ground{.name = "ground", .model = "table", .strength_offset_db = -2.0};
  CHECK_THROWS_WITH(strength_db(ground, 30.0), Catch::Contains("needs a CSV file of strengths"));
  ground.measured = std::make_shared<const scatter::StrengthTable>(
      std::vector<scatter::StrengthCurve>{{200e3, {20.0 * degree, 70.0 * degree}, {-30.0, -20.0}},
                                          {400e3, {10.0 * degree, 90.0 * degree}, {-35.0, -15.0}}});
  CHECK(strength_db(ground, 45.0) == Approx(-27.0));
  const auto warnings = [&](double frequency_hz) {
    return warnings_of(ground, *backscatter_of(ground, frequency_hz, 1500.0, 0.0), frequency_hz);
  };
  const auto all = warnings(100e3);
  REQUIRE(all.size() == 3);
  CHECK(all[0] ==
        "material ground: its table has 200 to 400 kHz: at 100 kHz the strengths of 200 kHz are "
        "used");
  CHECK(all[1].find("begins at 20 degrees") != std::string::npos);
  CHECK(all[2].find("ends at 70 degrees") != std::string::npos);
  CHECK(warnings(300e3).size() == 2);
}

TEST_CASE("Parameters that are given describe another rock than the measured one") {
  CHECK(strength_db({.like = "rock"}, 20.0) == Approx(-29.5));
  CHECK(strength_db({.like = "rock", .volume = 0.002}, 20.0) ==
        Approx(strength_db({.like = "handbook rock"}, 20.0)));
  CHECK(strength_db({.like = "rock", .strength_offset_db = -3.0}, 20.0) == Approx(-32.5));
  for (Material material : {Material{.model = "lambert", .lambert_mu_db = -20.0},
                            Material{.model = "solid", .like = "wood"}}) {
    const double without_db = strength_db(material, 60.0);
    material.strength_offset_db = -3.0;
    CHECK(strength_db(material, 60.0) == Approx(without_db - 3.0));
  }
}

TEST_CASE("A model warns of odd parameters, and a model without parameters never warns") {
  const auto warnings = [](const Material& material, double frequency_hz = 100e3) {
    return warnings_of(material, *backscatter_of(material, frequency_hz, 1500.0, 0.0),
                       frequency_hz);
  };
  CHECK(warnings({.like = "medium sand"}, 900e3).empty());  // frequencies: extrapolation.h
  CHECK(warnings({.model = "lambert"}).empty());
  CHECK(warnings({.model = "solid", .like = "steel"}).empty());
  const auto steep = warnings({.name = "bed", .like = "clay", .exponent = 3.95}, 400e3);
  REQUIRE(steep.size() == 1);
  CHECK(steep[0].starts_with("material bed: exponent 3.95"));
}
