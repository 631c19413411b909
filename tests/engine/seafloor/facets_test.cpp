#include <ensonify/engine/seafloor/objects/facets.h>

#include <cmath>
#include <numbers>

#include "engine/seafloor/spectrum.h"
#include "support/beds.h"
#include "support/body.h"
#include "support/catch.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/seafloor/make_seafloor.h>
#include <ensonify/engine/seafloor/objects/objects.h>
#include <ensonify/engine/seafloor/objects/shapes.h>
#include <ensonify/engine/seafloor/seafloor.h>

using namespace ensonify;
using namespace ensonify::engine;
using ensonify::tests::body;
using std::numbers::pi;

namespace {}  // namespace

TEST_CASE("The facet angle of a round shape is the angle that it was made with") {
  ShapeSize size;
  for (const double facet_deg : {7.5, 3.0, 1.0}) {
    size.facet_rad = facet_deg * degree;
    size.length_m = 40.0;  // the ends are a small part of it
    size.diameter_m = 0.5;
    CHECK(facet_angle_rad(body("cylinder", size)) == Approx(size.facet_rad.value()).epsilon(0.02));
    // For a ball the angle is a triangle's edge divided by sqrt(3). The edges are halved until it
    // is small enough.
    size.diameter_m = 1.0;
    const double across = facet_angle_rad(body("sphere", size)) * std::sqrt(3.0);
    CHECK(across < 1.15 * *size.facet_rad);  // facets differ in size
    CHECK(across > 0.45 * *size.facet_rad);
  }
  CHECK(facet_angle_rad(body("box", {})) == 0.0);
  CHECK(facet_angle_rad(body("wedge", {})) == 0.0);
}

TEST_CASE("Facets of round shapes are as small as their material's lobe needs, within a limit",
          "[slow]") {
  SeafloorOptions bed;
  bed.extent_east_m = bed.extent_north_m = 60.0;
  bed.cell_m = 2.0;
  bed.fractal.height_at_1m_m = 0.0;
  const auto place = [&](const ObjectOptions& table, double lobe_deg) {
    Material shiny{.name = "shiny", .model = "solid", .like = "steel"};
    shiny.lobe_width_rad = lobe_deg * degree;
    return make_seafloor(bed, 1, {&table, 1}, {&shiny, 1});
  };
  const auto faces = [](const Seafloor& seafloor) {
    return seafloor.mesh.faces.size() - seafloor.bed_faces;
  };
  ObjectOptions ball{.shape = "sphere", .material = "shiny"};
  CHECK(faces(place(ball, 5.0)) == 20 * 64);  // the usual number
  CHECK(faces(place(ball, 1.0)) == 20 * 4096);
  CHECK(place(ball, 1.0).warnings.empty());
  CHECK(place(ball, 0.5).warnings.empty());

  const Seafloor narrow = place(ball, 0.1);
  CHECK(faces(narrow) == 20 * 16384);
  REQUIRE(narrow.warnings.size() == 1);
  const std::string& warning = narrow.warnings.front();
  INFO(warning);
  CHECK(warning.starts_with("objects.0 (sphere): neighbouring facets differ by 0."));
  CHECK(warning.find("the lobe of shiny, 0.1 degrees wide") != warning.npos);

  ball.count = 100;
  ball.size.diameter_m = 0.2;
  const Seafloor many = place(ball, 0.5);
  CHECK(faces(many) <= 4000000);
  CHECK(many.warnings.size() == 1);

  ObjectOptions coarse{.shape = "cylinder", .material = "shiny"};
  coarse.size.facet_m = 0.1;  // 17 facets around it, as requested
  REQUIRE(place(coarse, 5.0).warnings.size() == 1);
  CHECK(place(coarse, 5.0).warnings.front().find("facet_m") != std::string::npos);
  coarse.material = "medium sand";  // has no lobe
  CHECK(place(coarse, 5.0).warnings.empty());
  coarse.shape = "box", coarse.size = {}, coarse.material = "shiny";
  CHECK(place(coarse, 0.1).warnings.empty());
}

TEST_CASE(
    "Members of an assembly have facets for its number of copies, and warnings of their own") {
  const Seafloor floor = ensonify::tests::level_bed(20.0, 60.0);
  const BedGrid bed(floor);
  Material shiny{.name = "shiny", .model = "solid", .like = "steel"};
  shiny.lobe_width_rad = 0.3 * degree;
  ObjectOptions crate{.shape = "box", .assembly = "site", .material = "shiny"};
  ObjectOptions ball{.shape = "sphere", .assembly = "site", .material = "shiny"};
  ball.size.diameter_m = 0.2;
  const auto place = [&] { return place_objects(std::vector{crate, ball}, 1, bed, {&shiny, 1}); };
  CHECK(place().warnings.empty());
  crate.count = 60;
  const PlacedObjects many = place();
  std::size_t faces = 0;
  for (const PlacedObjects::One& object : many.objects) faces += object.mesh.faces.size();
  CHECK(faces <= 4000000);
  REQUIRE(many.warnings.size() == 1);
  CHECK(many.warnings.front().starts_with("objects.1 (sphere): neighbouring facets"));
  CHECK(many.warnings.front().find("fewer objects") != std::string::npos);
  crate.count = 0;
  ball.material = "medium sand";  // has no lobe
  CHECK(place().warnings.empty());
}
