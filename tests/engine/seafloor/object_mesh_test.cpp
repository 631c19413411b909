#include <ensonify/engine/seafloor/object_mesh.h>

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "support/beds.h"
#include "support/catch.h"

#include <ensonify/engine/seafloor/objects/object_surface.h>
#include <ensonify/engine/seafloor/objects/objects.h>
#include <ensonify/engine/seafloor/objects/shapes.h>

using namespace ensonify;
using namespace ensonify::engine;
using Eigen::Vector3d;

namespace {

/// An object on a level bed, so far to the east.
PlacedObjects placed_objects(const ShapeKind& kind, double east_m) {
  Seafloor bed = tests::level_bed(20.0, 1e6);
  ObjectOptions options{.shape = std::string(kind.name)};
  options.east_m = east_m;
  options.north_m = 3.7;
  options.heading_rad = 0.3;
  if (kind.along_path) options.path = {{0.0, 0.0}, {0.0, 8.0}, {3.0, 12.0}};
  return place_objects({&options, 1}, 1, BedGrid(bed));
}
PlacedObjects::One placed(const ShapeKind& kind, double east_m) {
  return placed_objects(kind, east_m).objects.front();
}

}  // namespace

TEST_CASE("An object's flat parts and curvatures are the same wherever on the seabed it lies") {
  for (const ShapeKind& kind : shape_kinds()) {
    const PlacedObjects::One near = placed(kind, 0.0);
    const ObjectSurface expected(near.own, 1);
    for (const double east_m : {1e3, 1e4, 1e5, 5e5}) {
      CAPTURE(kind.name, east_m);
      const PlacedObjects::One far = placed(kind, east_m);
      CHECK((far.record.size_m - near.record.size_m).norm() < 1e-9);
      const ObjectSurface got(far.own, 1);
      REQUIRE(got.flat_parts.size() == expected.flat_parts.size());
      REQUIRE(got.curved.corners.size() == expected.curved.corners.size());
      CHECK(got.corners.size() == expected.corners.size());
      constexpr double same_m = 1e-9;
      const Vector3d moved(east_m, 0.0, 0.0);
      std::size_t different = 0;
      for (std::size_t i = 0; i < got.flat_parts.size(); ++i) {
        const FlatPart &a = got.flat_parts[i], &b = expected.flat_parts[i];
        if ((a.middle - b.middle - moved).norm() > same_m || a.normal != b.normal ||
            a.length_m != b.length_m || a.bend_along_rad != b.bend_along_rad ||
            a.facets != b.facets || a.surface != b.surface)
          ++different;
      }
      for (std::size_t i = 0; i < got.curved.corners.size(); ++i) {
        const FacetCorner &a = got.curved.corners[i], &b = expected.curved.corners[i];
        if ((a.place - b.place - moved).norm() > same_m || a.normal != b.normal ||
            a.per_m2 != b.per_m2)
          ++different;
      }
      CHECK(different == 0);
    }
  }
}

TEST_CASE("An object so far from the seabed's middle that floats turn its facets is warned of") {
  const ShapeKind& tyre = shape_named("tyre");
  for (const double east_m : {0.0, 1e3, 1e4}) CHECK(placed_objects(tyre, east_m).warnings.empty());
  const std::vector<std::string> warnings = placed_objects(tyre, 5e5).warnings;
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Catch::StartsWith("objects.0 (tyre): lies 500 km from the middle of the "
                                            "seabed, where vertices are 0.031 m apart"));
}

TEST_CASE("The meshes of objects come back from their bytes, and other bytes are refused") {
  std::vector<ObjectMesh> meshes(2);
  meshes[0] = placed(shape_named("tyre"), 5e5).own;
  const std::string bytes = bytes_of(meshes);
  const std::vector<ObjectMesh> back = object_meshes_of(bytes);
  REQUIRE(back.size() == 2);
  CHECK(back[0].positions == meshes[0].positions);
  CHECK(back[0].faces == meshes[0].faces);
  CHECK(back[0].place == meshes[0].place);
  CHECK(back[0].rounding_m == meshes[0].rounding_m);
  CHECK(back[1].faces.empty());
  CHECK(object_meshes_of({}).empty());
  for (const std::size_t left : {1, 47, 100, static_cast<int>(bytes.size()) - 1})
    CHECK_THROWS_AS(object_meshes_of(std::string_view(bytes).substr(0, left)), std::out_of_range);
  meshes[0].faces.back()[1] = static_cast<std::uint32_t>(meshes[0].positions.size());
  CHECK_THROWS_AS(object_meshes_of(bytes_of(meshes)), std::out_of_range);
  meshes[0].faces.back()[1] = 0;
  meshes[0].positions.back().x() = NAN;
  CHECK_THROWS_AS(object_meshes_of(bytes_of(meshes)), std::out_of_range);
}
