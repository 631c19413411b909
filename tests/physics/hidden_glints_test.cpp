// Glints of partly hidden bodies against sums over the visible parts.

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <initializer_list>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "physics/body_in_water.h"
#include "support/catch.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/seafloor/objects/solids.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

TEST_CASE("a plate that another thing hides in part glints as Kirchhoff's integral over the rest") {
  constexpr double before_m = 1.0;
  refine::TriangleMesh plate = upright_cells(1.0, [](int, int) { return true; });
  for (Eigen::Vector3f& place : plate.positions) place.z() *= 0.6f;
  for (const auto& [array_m, planes] : {std::pair{0.5, 0}, {0.03, 512}})
    for (const double range_m : {10.0, 40.0})
      for (const double turned_deg : {0.0, 0.3})
        for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0})
          for (const bool from_below : {true, false}) {
            Sonar sonar = wide_sonar(range_m + 2.0);
            sonar.array_length_m = array_m;
            if (planes > 0) sonar.planes = planes;
            Body body{plate, nothing, 1.0, turned_deg * degree};
            // As seen from the sonar, the hidden share lies to the south or below, and the hider
            // reaches well beyond the plate.
            const double seen = (range_m - before_m) / range_m;
            const Eigen::Vector2d half(0.5, 0.3), edge = seen * (2.0 * share - 1.0) * half;
            body.hider = Hider{before_m, {-2.0, -2.0}, {2.0, 2.0}};
            if (share < 1.0)
              (from_below ? body.hider->high.y() : body.hider->high.x()) =
                  from_below ? edge.y() : edge.x();
            const double mirror_m2 = 0.25 * range_m * range_m;
            const double got =
                scatter::from_db(target_strength_db(echo_of(body, sonar, range_m), sonar));
            CAPTURE(array_m, range_m, turned_deg, share, from_below);
            if (share == 1.0) {
              CHECK(got < 1e-7);  // the faint diffuse echoes alone
              continue;
            }
            const double expected = scatter::from_db(kirchhoff_db(body, sonar, range_m));
            CHECK(got == Approx(expected).epsilon(0.25).margin(0.02 * mirror_m2));
          }
}

TEST_CASE("a plate or a cylinder that is wholly hidden does not glint, wherever the sonar is") {
  ShapeSize size;
  size.diameter_m = 0.2;
  size.length_m = 0.6;
  const refine::TriangleMesh plate = upright_cells(0.3, [](int, int) { return true; }),
                             cylinder = body("cylinder", size);
  for (const refine::TriangleMesh* mesh : {&plate, &cylinder})
    for (const auto& [frequency_hz, array_m, range_m] :
         {std::tuple{100e3, 0.2, 40.0}, {400e3, 0.5, 10.0}, {900e3, 0.2, 20.0}})
      for (int i = -60; i <= 60; ++i) {
        Sonar sonar = wide_sonar(range_m + 2.0, frequency_hz);
        sonar.array_length_m = array_m;
        const double north_m = 0.025 * i;
        Body body{*mesh, nothing, 1.0, 0.0, north_m};
        body.hider = Hider{1.0, {north_m - 0.8, -0.6}, {north_m + 0.8, 0.6}};
        CAPTURE(mesh == &cylinder, frequency_hz, array_m, range_m, north_m);
        CHECK(target_strength_db(echo_of(body, sonar, range_m), sonar) < -60.0);
      }
}

TEST_CASE("a cylinder that another thing hides in part glints as the sum over the rest") {
  constexpr double before_m = 1.0, radius_m = 0.2, length_m = 2.0;
  ShapeSize size;
  size.diameter_m = 2.0 * radius_m;
  size.length_m = length_m;
  const refine::TriangleMesh cylinder = body("cylinder", size);
  for (const auto& [array_m, planes] : {std::pair{0.5, 0}, {0.03, 512}})
    for (const double range_m : {10.0, 40.0})
      for (const double share : {0.25, 0.5, 0.6, 0.75}) {
        Sonar sonar = wide_sonar(range_m + 2.0);
        sonar.array_length_m = array_m;
        if (planes > 0) sonar.planes = planes;
        Body body{cylinder, nothing, 1.0};
        const double edge_m = (share - 0.5) * length_m, side_m = range_m - radius_m;
        body.hider = Hider{before_m, {-2.0, -2.0}, {edge_m * (range_m - before_m) / side_m, 2.0}};
        CAPTURE(array_m, range_m, share);
        const double expected = scatter::from_db(cylinder_db(radius_m, (1.0 - share) * length_m,
                                                             side_m, 1500.0 / sonar.frequency_hz,
                                                             &sonar, 0.5 * share * length_m));
        CHECK(scatter::from_db(target_strength_db(echo_of(body, sonar, range_m), sonar)) ==
              Approx(expected).epsilon(0.25).margin(0.02 * 0.25 * radius_m * range_m));
      }
}
