// Layers on windows of a bed against the same layers on all of it.

#include <ensonify/engine/seafloor/layers/seabed_in_windows.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/seafloor/bed/fractal.h>
#include <ensonify/refine/height_tiles.h>

#include "engine/seafloor/spectrum.h"
#include "support/catch.h"
#include "support/files.h"
#include "support/message.h"
#include "support/temporary_folder.h"

using namespace ensonify::engine;
using namespace ensonify::tests;
using ensonify::refine::HeightTiles;

namespace {

/// Heights as tiles have them: floats.
Heightfield rough_bed(int columns, int rows, double cell_m) {
  Heightfield field = flat(columns, rows, cell_m, cell_m);
  add_fractal(field, {.height_at_1m_m = 0.15, .hurst = 0.7}, 3);
  for (double& z : field.z_m) z = static_cast<float>(z - 20.0);
  return field;
}

HeightTiles::Heights windows_of(const Heightfield& field) {
  return [&field](int first_column, int first_row, int columns, int rows, std::span<double> z_m,
                  std::span<std::uint8_t>) {
    for (int row = 0; row < rows; ++row)
      std::copy_n(field.z_m.begin() +
                      static_cast<std::ptrdiff_t>(field.index(first_column, first_row + row)),
                  columns, z_m.begin() + std::ptrdiff_t{row} * columns);
  };
}

/// Layers of each kind that fits windows, and areas with each limit but a share.
SeabedOptions many_layers() {
  SeabedOptions seabed;
  seabed.patches.resize(4);
  seabed.patches[0] = {
      .area = {.polygon_m = {{-30, -25}, {12, -20}, {5, 28}, {-20, 20}}, .ragged_m = 0.6},
      .material = "sandy mud"};
  seabed.patches[1] = {.area = {.radius_m = 9.0, .middle_east_m = 14.0, .border_m = 4.0},
                       .material = "seagrass",
                       .class_name = "seagrass",
                       .rise_m = 0.3};
  seabed.patches[2] = {.area = {.gentlest_rad = 0.08}, .material = "gravel"};
  seabed.patches[3] = {.area = {.shallowest_m = 20.2, .on = "gravel"}, .material = "cobble"};
  seabed.bedforms.resize(2);
  seabed.bedforms[0].relief.wavelength_m = 1.1;
  seabed.bedforms[0].area.on = "sandy mud";
  seabed.bedforms[1].relief.wavelength_m = 14.0;
  seabed.bedforms[1].relief.height_m = 0.4;
  seabed.trawl_marks.resize(1);
  seabed.trawl_marks[0].relief.door_spacing_m = 12.0;
  seabed.pits.resize(2);
  seabed.pits[0].relief.per_hectare = 400.0;
  seabed.pits[0].relief.diameter_m = 3.0;
  seabed.pits[1].relief = {
      .per_hectare = 40.0, .diameter_m = 4.0, .rim_ratio = 0.1, .elongation = 3.0};
  seabed.pits[1].area.on = "sandy mud";
  seabed.boulders.resize(1);
  seabed.boulders[0].relief.per_hectare = 300.0;
  seabed.boulders[0].area.on = "medium sand";
  return seabed;
}

}  // namespace

TEST_CASE("Windows of a seabed have the heights and the kinds of the whole, to the bit") {
  constexpr int columns = 331, rows = 290;
  Heightfield base = rough_bed(columns, rows, 0.2);
  const auto is_hole = [](std::size_t point) { return point * 2654435761u % 97 == 0; };
  for (std::size_t i = 0; i < base.z_m.size(); ++i)
    if (is_hole(i)) base.z_m[i] = std::numeric_limits<double>::quiet_NaN();
  const SeabedOptions seabed = many_layers();
  Heightfield whole = base;
  const SeabedMap map = lay_seabed(whole, seabed, "medium sand", 6);
  const std::vector<SeabedMap::Kind> kinds_of_bed = possible_kinds(seabed, "medium sand");
  CHECK(kinds_of_bed.front() == SeabedMap::Kind{"medium sand", "seabed"});
  CHECK(map.kinds.size() > 8);
  const HeightTiles::Heights in_windows =
      with_seabed(base, windows_of(base), seabed, "medium sand", 6);
  struct Part {
    int column, row, columns, rows;
  };
  for (const Part& part : {Part{0, 0, columns, rows},
                           {0, 0, 60, 50},
                           {100, 120, 90, 70},
                           {columns - 75, 30, 75, 41},
                           {150, rows - 33, 64, 33},
                           {200, 200, 1, 1}}) {
    CAPTURE(part.column, part.row, part.columns, part.rows);
    const auto points =
        static_cast<std::size_t>(part.columns) * static_cast<std::size_t>(part.rows);
    std::vector<double> z_m(points);
    std::vector<std::uint8_t> kinds(points);
    in_windows(part.column, part.row, part.columns, part.rows, z_m, kinds);
    int heights_differ = 0, kinds_differ = 0;
    for (int row = 0; row < part.rows; ++row)
      for (int column = 0; column < part.columns; ++column) {
        const std::size_t i =
            static_cast<std::size_t>(row) * static_cast<std::size_t>(part.columns) +
            static_cast<std::size_t>(column);
        const std::size_t point = whole.index(part.column + column, part.row + row);
        heights_differ += is_hole(point) ? !std::isnan(z_m[i]) : z_m[i] != whole.z_m[point];
        kinds_differ += !(kinds_of_bed[kinds[i]] == map.kinds[map.point_kind[point]]);
      }
    CHECK(heights_differ == 0);
    CHECK(kinds_differ == 0);
  }
}

TEST_CASE(
    "A share of an area is the same share of many windows, and continues over their borders") {
  const Heightfield base = flat(1201, 1001, 0.5, 0.5);
  SeabedOptions seabed;
  seabed.patches.resize(1);
  seabed.patches[0].area.patch_m = 12.0;
  for (const double wanted : {0.1, 0.35, 0.8}) {
    CAPTURE(wanted);
    seabed.patches[0].area.share = wanted;
    const auto in_windows = with_seabed(base, windows_of(base), seabed, "medium sand", 2);
    std::vector<double> z_m(base.z_m.size());
    std::vector<std::uint8_t> all(z_m.size()), part(101 * 101);
    in_windows(0, 0, base.columns, base.rows, z_m, all);
    const auto taken = static_cast<double>(std::ranges::count(all, 1));
    CHECK(taken / static_cast<double>(all.size()) == Approx(wanted).margin(0.03));
    in_windows(500, 400, 101, 101, std::span(z_m).first(part.size()), part);
    int differ = 0;
    for (int row = 0; row < 101; ++row)
      for (int column = 0; column < 101; ++column)
        differ += part[static_cast<std::size_t>(row * 101 + column)] !=
                  all[base.index(500 + column, 400 + row)];
    CHECK(differ == 0);
  }
}

TEST_CASE("Tiles with layers have the same bytes, whichever is made first") {
  const TemporaryFolder folder;
  const Heightfield base = rough_bed(1100, 60, 0.2);
  const SeabedOptions seabed = many_layers();
  std::vector<float> x_m, y_m;
  for (int column = 0; column < base.columns; ++column)
    x_m.push_back(static_cast<float>(base.x_m(column)));
  for (int row = 0; row < base.rows; ++row) y_m.push_back(static_cast<float>(base.y_m(row)));
  const auto make = [&](const char* name, const std::array<std::size_t, 2>& order) {
    HeightTiles tiles(
        x_m, y_m, Eigen::Vector3d::Zero(), [](HeightTiles::Shape&) {},
        with_seabed(base, windows_of(base), seabed, "medium sand", 8), folder.path() / name, "k",
        true);
    REQUIRE(tiles.chunks() == order.size());
    for (const std::size_t chunk : order) tiles.require_chunk(chunk);
    return read_text(folder.path() / name);
  };
  CHECK(make("a.tiles", {0, 1}) == make("b.tiles", {1, 0}));
}

TEST_CASE(
    "Roughness is the same in all windows, as rough as it is asked to be, and each layer its own") {
  constexpr double cell_m = 0.25;
  const Heightfield base = flat(1300, 1200, cell_m, cell_m);
  SeabedOptions seabed;
  seabed.roughness.resize(1);
  seabed.roughness[0].relief = {.height_at_1m_m = 0.06, .hurst = 0.6};
  seabed.roughness[0].area.number = 1;
  const auto heights_of = [&](const SeabedOptions& options, int column, int row, int columns,
                              int rows) {
    std::vector<double> z_m(static_cast<std::size_t>(columns * rows));
    with_seabed(base, windows_of(base), options, "medium sand", 8)(column, row, columns, rows, z_m,
                                                                   {});
    return z_m;
  };
  const auto whole = heights_of(seabed, 0, 0, 1300, 1200);
  // Across the borders of blocks, which are 1024 points apart.
  for (const auto& [column, row, columns, rows] :
       {std::array{1000, 1000, 60, 50}, {1024, 0, 100, 20}, {0, 1023, 30, 2}}) {
    const auto part = heights_of(seabed, column, row, columns, rows);
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < columns; ++i)
        REQUIRE(part[static_cast<std::size_t>(j * columns + i)] ==
                whole[static_cast<std::size_t>((row + j) * 1300 + column + i)]);
  }
  const auto rms_difference = [](const std::vector<double>& z_m, std::size_t lag) {
    double square = 0.0, count = 0.0;
    for (std::size_t i = lag; i < z_m.size(); ++i) {
      if (i % 1300 < lag) continue;
      square += (z_m[i] - z_m[i - lag]) * (z_m[i] - z_m[i - lag]);
      ++count;
    }
    return std::sqrt(square / count);
  };
  CHECK(rms_difference(whole, 4) == Approx(0.06).epsilon(0.05));  // 1 m
  CHECK(rms_difference(whole, 8) == Approx(0.06 * std::pow(2.0, 0.6)).epsilon(0.07));

  // Another layer has other heights: the squares of both add up.
  SeabedOptions two = seabed;
  two.roughness.push_back(seabed.roughness[0]);
  two.roughness[1].area.number = 2;
  CHECK(rms_difference(heights_of(two, 0, 0, 1300, 1200), 4) ==
        Approx(0.06 * std::sqrt(2.0)).epsilon(0.05));
  // The same layer, with the same draws, adds to itself.
  two.roughness[1].area.number = 1;
  CHECK(rms_difference(heights_of(two, 0, 0, 1300, 1200), 4) == Approx(0.12).epsilon(0.05));
  // On a part only.
  seabed.roughness[0].area = {.radius_m = 30.0, .middle_east_m = 100.0, .number = 1};
  const auto part = heights_of(seabed, 0, 0, 1300, 1200);
  CHECK(part[0] == 0.0);
  CHECK(part[600 * 1300 + 1050] == whole[600 * 1300 + 1050]);  // 100 m east of the middle
}

TEST_CASE("A seabed in windows refuses what it cannot have, by its key and with what to do") {
  const Heightfield grid = flat(200, 200, 0.25, 0.25);
  SeabedOptions seabed;
  seabed.outcrops.resize(1);
  CHECK(obstacle_to_windows(grid, seabed)->key == "seafloor.outcrops.0");
  CHECK_THROWS_WITH(require_windows(grid, seabed),
                    Catch::Contains("seafloor.outcrops.0") && Catch::Contains("remove it"));
  seabed = {};
  seabed.roughness.resize(1);
  CHECK_FALSE(obstacle_to_windows(grid, seabed));
  CHECK_THROWS_WITH(require_windows(flat(200, 200, 0.25, 0.5), seabed),
                    Catch::Contains("seafloor.roughness.0") && Catch::Contains("square"));
  seabed = {};
  seabed.patches.resize(1);
  seabed.patches[0].area.image.path = "map.png";
  CHECK_THROWS_WITH(require_windows(grid, seabed), Catch::Contains("gdal_polygonize"));
  seabed = {};
  seabed.pits.resize(2);
  seabed.pits[1].relief.diameter_m = 500.0;
  CHECK_THROWS_WITH(require_windows(grid, seabed), Catch::Contains("seafloor.pits.1"));
  seabed.pits.resize(1);
  CHECK_FALSE(obstacle_to_windows(grid, seabed));
  seabed.bedforms.resize(1);
  seabed.bedforms[0].relief.wavelength_m = 0.5;  // two cells
  CHECK_THROWS_WITH(require_windows(grid, seabed), Catch::Contains("seafloor.crests.0"));
  seabed = {};
  seabed.patches.resize(2);
  Area& area = seabed.patches[1].area;
  const TemporaryFolder folder;
  const auto check_outside = [&](const Area& outside) {
    area = outside;
    CHECK_THROWS_WITH(require_windows(grid, seabed),
                      Catch::Contains("seafloor.patches.1: an area lies outside the seabed, which "
                                      "spans -24.9 to 24.9 m east"));
  };
  check_outside({.polygon_m = {{50, 50}, {60, 50}, {60, 60}}});
  check_outside({.radius_m = 5.0, .middle_east_m = -31.0});
  // Each on the bed, but not both at one place.
  check_outside({.polygon_m = {{5, 5}, {6, 5}, {6, 6}}, .radius_m = 2.0});
  write_text(folder / "area.geojson",
             R"({"type":"Polygon","coordinates":[[[0,90],[9,90],[9,99],[0,90]]]})");
  check_outside({.outline = {"", folder / "area.geojson"}});
  area = {.radius_m = 5.0, .middle_east_m = -29.0};
  CHECK_NOTHROW(require_windows(grid, seabed));
  area = {.radius_m = 5.0, .middle_east_m = -31.0, .ragged_m = 1.0};
  CHECK_NOTHROW(require_windows(grid, seabed));
  seabed = {};
  seabed.pits.resize(20);
  for (std::size_t i = 0; i < seabed.pits.size(); ++i) {
    seabed.pits[i].class_name = "class " + std::to_string(i);
    seabed.pits[i].material = "material " + std::to_string(i);
  }
  CHECK(possible_kinds(seabed, "medium sand").size() == 21);
  for (auto& pits : seabed.pits) pits.material.clear();
  seabed.patches.resize(13);
  for (std::size_t i = 0; i < seabed.patches.size(); ++i)
    seabed.patches[i].material = "patch " + std::to_string(i);
  CHECK_THROWS_WITH(possible_kinds(seabed, "medium sand"), Catch::Contains("256"));
}

TEST_CASE("An area without a point of the bed is refused in tiles as at once") {
  const Heightfield grid = rough_bed(40, 30, 0.5);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> east(-12.0, 12.0), north(-9.0, 9.0), small(-0.3, 0.3);
  int without = 0, with = 0;
  const auto check_alike = [&](const Area& area) {
    SeabedOptions seabed;
    seabed.patches.resize(1);
    seabed.patches[0].area = area;
    const auto fault = [](const auto& lay) { return message_thrown<SceneError>(lay); };
    Heightfield bed = grid;
    const std::string at_once = fault([&] { lay_seabed(bed, seabed, "medium sand", 1); });
    CHECK(fault([&] { require_windows(grid, seabed); }) == at_once);
    ++(at_once.empty() ? with : without);
  };
  for (int i = 0; i < 2000; ++i) {
    CAPTURE(i);
    const Eigen::Vector2d a(east(random), north(random));
    const Eigen::Vector2d along(small(random), small(random)), aside(small(random), small(random));
    // Slivers of any length, and small discs.
    check_alike({.polygon_m = {a, a + std::pow(2.0, i % 7) * along, a + aside}});
    check_alike({.radius_m = 0.1 + std::abs(small(random)),
                 .middle_east_m = a.x(),
                 .middle_north_m = a.y()});
  }
  CHECK(with > 500);
  CHECK(without > 500);
}

TEST_CASE("A layer on a material that no earlier layer has is a warning, in tiles and at once") {
  SeabedOptions seabed;
  seabed.patches.resize(3);
  seabed.patches[0] = {.area = {.radius_m = 3.0, .on = "medium sand"}, .material = "gravel"};
  seabed.patches[1] = {.area = {.on = "rock"}, .material = "coarse silt"};
  seabed.patches[2] = {.area = {.on = "gravel"}, .material = "rock"};
  seabed.pits.resize(2);
  seabed.pits[0].area.on = "coarse silt";
  seabed.pits[1].area.on = "rock";
  Heightfield bed = rough_bed(40, 30, 0.5);
  const std::vector<std::string> warnings = lay_seabed(bed, seabed, "medium sand", 1).warnings;
  REQUIRE(warnings.size() == 2);
  CHECK_THAT(warnings[0], Catch::StartsWith("seafloor.patches.1: has no effect") &&
                              Catch::Contains("that its key 'on' names"));
  CHECK_THAT(warnings[1], Catch::StartsWith("seafloor.pits.0: has no effect"));
  CHECK(nowhere_on_warnings(seabed, "medium sand") == warnings);
  CHECK(nowhere_on_warnings({}, "medium sand").empty());
}

TEST_CASE("Depths and slopes that a sample of the bed has nowhere are a warning") {
  const Heightfield base = rough_bed(900, 700, 0.2);
  const auto warnings_of = [&](const Area& area) {
    SeabedOptions seabed;
    seabed.patches.resize(2);
    seabed.patches[1].area = area;
    return unfound_area_warnings(base, seabed, [&] { return windows_of(base); });
  };
  const auto check_unfound = [&](const Area& area) {
    const std::vector<std::string> warnings = warnings_of(area);
    REQUIRE(warnings.size() == 1);
    CHECK_THAT(warnings[0], Catch::StartsWith("seafloor.patches.1: at 64 places"));
  };
  const auto [lowest, highest] = std::ranges::minmax(base.z_m);
  check_unfound({.shallowest_m = -lowest + 0.01});
  check_unfound({.deepest_m = -highest - 0.01});
  check_unfound({.gentlest_rad = 1.4});
  CHECK(warnings_of({.shallowest_m = 20.0}).empty());
  CHECK(warnings_of({.deepest_m = 20.0, .steepest_rad = 0.5}).empty());
  SeabedOptions without_limits;
  without_limits.patches.resize(1);
  CHECK(unfound_area_warnings(base, without_limits, {}).empty());
}
