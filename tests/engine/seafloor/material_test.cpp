#include <ensonify/engine/seafloor/material.h>

#include <numbers>
#include <vector>

#include "support/catch.h"

#include <ensonify/scatter/composite_roughness.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/solid_target.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

constexpr double degree = std::numbers::pi / 180.0;

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
                    Catch::Contains("sediment 'stel' is not known") &&
                        Catch::Contains("solids are steel, aluminium") &&
                        Catch::Contains("[material.stel]"));
}

TEST_CASE(
    "Each model scatters by its own formula, with the parameters that the material overrides") {
  const double grazing_deg = 35.0, g = grazing_deg * degree;
  CHECK(strength_db({.model = "lambert", .lambert_mu_db = -20.0}, grazing_deg) ==
        Approx(scatter::to_db(scatter::Lambert(-20.0).cross_section(g))));
  const scatter::Solid wood = scatter::solid_named("wood");
  CHECK(strength_db({.model = "solid", .like = "wood", .specular = 0.5}, 89.0) ==
        Approx(scatter::to_db(scatter::SolidTarget({wood.diffuse_db, 0.5, wood.lobe_width_rad})
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

TEST_CASE("A model warns outside its range, and a model without a range never warns") {
  CHECK(!validity_warning({.like = "medium sand"}, 100e3));
  CHECK(validity_warning({.name = "bed", .like = "medium sand"}, 400e3)
            ->starts_with("material bed: 400 kHz"));
  CHECK(!validity_warning({.model = "lambert"}, 400e3));
  CHECK(!validity_warning({.model = "solid", .like = "steel"}, 400e3));
}
