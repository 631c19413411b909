// Long work on a bed ends at any call of its stop check.

#include <functional>

#include <ensonify/engine/seafloor/bed/fractal.h>
#include <ensonify/engine/seafloor/bed/ripples.h>
#include <ensonify/engine/seafloor/bed/tessellate.h>
#include <ensonify/engine/seafloor/bed_height.h>
#include <ensonify/engine/seafloor/make_seafloor.h>
#include <ensonify/engine/trace/intersector.h>

#include "engine/seafloor/spectrum.h"
#include "support/catch.h"

using namespace ensonify::engine;

namespace {

struct Stop {};

using Work = std::function<void(const std::function<void()>& stop_check)>;

/// How often some work calls its stop check, after it was stopped at each tenth of these calls.
int calls_of(const Work& work) {
  int all = 0;
  work([&] { ++all; });
  for (int tenth = 0; tenth < 10; ++tenth) {
    int left = tenth * all / 10;
    if (all > 0)
      CHECK_THROWS_AS(work([&] {
                        if (left-- == 0) throw Stop();
                      }),
                      Stop);
  }
  return all;
}

}  // namespace

TEST_CASE("Relief can be stopped at each row of its transforms") {
  const int columns = 60, rows = 50;
  CHECK(calls_of([&](const auto& stop_check) {
          Heightfield field = ensonify::tests::flat(columns, rows, 1.0, 1.0);
          add_fractal(field, {}, 1, {1, stop_check});
        }) >= 2 * rows);
  CHECK(calls_of([&](const auto& stop_check) {
          Heightfield field = ensonify::tests::flat(columns, rows, 0.1, 0.1);
          add_ripples(field, {.rms_height_m = 0.1}, 1, {1, stop_check});
        }) >= 2 * rows);
}

TEST_CASE("A grid of heights and its mesh can be stopped at each row") {
  const Heightfield field = ensonify::tests::flat(9, 70, 1.0, 1.0);
  CHECK(calls_of([&](const auto& stop_check) { height_grid(field, stop_check); }) == 70);
  const ensonify::refine::HeightGrid grid = height_grid(field);
  CHECK(calls_of([&](const auto& stop_check) { grid.mesh(stop_check); }) == 69);
}

TEST_CASE("The exact tree over a mesh and the grid for its heights can be stopped") {
  SeafloorOptions options;
  options.extent_east_m = options.extent_north_m = 150.0;
  options.cell_m = 0.5;
  const Seafloor seafloor = make_seafloor(options, 1);  // 180,000 faces
  CHECK(calls_of([&](const auto& stop_check) { BedGrid(seafloor, stop_check); }) > 5);
  for (const char* name : {"pluecker", "brute_force"}) {
    CAPTURE(name);
    CHECK(calls_of([&](const auto& stop_check) {
            make_intersector(name, seafloor.mesh, {.stop_check = stop_check});
          }) > 100);
  }
}
