#include <ensonify/engine/seafloor/bed_height.h>

#include <array>
#include <cmath>

#include "support/beds.h"
#include "support/catch.h"

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/seafloor/make_seafloor.h>
#include <ensonify/engine/trace/intersector.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

/// The height that the exact tracer finds, looking down from above.
double by_ray(const Intersector& tracer, double x_m, double y_m) {
  const Ray down{{x_m, y_m, 100.0}, -Eigen::Vector3d::UnitZ(), 0.0, 1000.0};
  Hit hit;
  tracer.intersect({&down, 1}, {&hit, 1});
  return hit ? 100.0 - hit.t : std::nan("");
}

}  // namespace

TEST_CASE("The bed's height without objects is what the exact tracer finds below") {
  SeafloorOptions options;
  options.extent_east_m = 30.0;
  options.extent_north_m = 11.0;
  options.cell_m = 0.5;
  Seafloor seafloor = make_seafloor(options, 3);
  // A hole, and a fold: two sheets over one place; the upper one is the bed.
  seafloor.mesh.faces.erase(seafloor.mesh.faces.begin() + 500, seafloor.mesh.faces.begin() + 560);
  const auto first = static_cast<std::uint32_t>(seafloor.mesh.positions.size());
  for (const Eigen::Vector3f& p : {Eigen::Vector3f{2, -3, -14}, {6, -2, -15}, {3, 4, -13}})
    seafloor.mesh.positions.push_back(p);
  seafloor.mesh.faces.push_back({first, first + 1, first + 2});
  seafloor.bed_faces = seafloor.mesh.faces.size();
  const refine::TriangleMesh bed = seafloor.mesh;
  tests::add_box(seafloor, {-8, -2, -25}, {-5, 2, -10});

  const auto tracer = make_intersector("pluecker", bed);
  const BedGrid below(seafloor);
  int holes = 0, grid = 0;
  std::array<double, 2> place;
  for (std::uint64_t i = 0; i < 3000; ++i) {
    RandomStream(1, Purpose::test, {i, 0, 0}).uniform(place);
    double x_m = 33.0 * place[0] - 16.5, y_m = 13.0 * place[1] - 6.5;
    if (i % 3 == 0) {  // along grid lines, and on vertices
      x_m = std::round(2.0 * x_m) / 2.0;
      if (i % 2 == 0) y_m = std::round(2.0 * y_m) / 2.0;
      // The tie rules differ only on the outer border.
      if (std::abs(x_m) > 14.9 || std::abs(y_m) > 5.4) continue;
      ++grid;
    }
    const double expected = by_ray(*tracer, x_m, y_m), found = below.height_m(x_m, y_m);
    CAPTURE(x_m, y_m, expected, found);
    REQUIRE(std::isnan(expected) == std::isnan(found));
    if (std::isnan(found))
      ++holes;
    else
      REQUIRE(found == Approx(expected).epsilon(0).margin(1e-9));
  }
  CHECK(holes > 300);
  CHECK(grid > 500);
}

TEST_CASE("A bed of two large faces has the same heights as one of many faces, and none outside") {
  const Seafloor seafloor = tests::level_bed(20.0, 50.0);
  const BedGrid below(seafloor);
  CHECK(below.height_m(0.0, 0.0) == -20.0);
  CHECK(below.height_m(-49.9, 49.9) == -20.0);
  CHECK(std::isnan(below.height_m(-50.1, 0.0)));
  CHECK(std::isnan(below.height_m(0.0, 1e9)));
}
