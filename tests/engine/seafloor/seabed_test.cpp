#include <ensonify/engine/seafloor/layers/seabed.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/output/png.h>
#include <ensonify/engine/seafloor/bed/survey.h>
#include <ensonify/engine/seafloor/make_seafloor.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/refine/triangle_mesh.h>

#include "engine/seafloor/spectrum.h"
#include "support/catch.h"
#include "support/files.h"
#include "support/grids.h"
#include "support/temporary_folder.h"

using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

using std::numbers::pi;

std::vector<double> mask_of(const Area& area, const Heightfield& grid, std::uint64_t seed = 1) {
  return area_mask(area, {grid, [](std::size_t, const std::string&) { return true; }},
                   {seed, Purpose::seabed_patch, 1});
}
double share(const std::vector<double>& mask) {
  double sum = 0.0;
  for (const double m : mask) sum += m;
  return sum / static_cast<double>(mask.size());
}

SeafloorOptions options() {
  SeafloorOptions bed;
  bed.extent_east_m = 60.0;
  bed.extent_north_m = 40.0;
  bed.cell_m = 0.25;
  bed.depth_m = 15.0;
  bed.fractal.height_at_1m_m = 0.0;
  return bed;
}

}  // namespace

TEST_CASE("A polygon and a disc hold the area that geometry says") {
  const Heightfield grid = flat(401, 301, 0.1, 0.1);
  Area triangle;
  triangle.polygon_m = {{-10.0, -8.0}, {12.0, -5.0}, {-2.0, 9.0}};
  const double area = 0.5 * std::abs(22.0 * 17.0 - 8.0 * 3.0);  // cross product of two sides
  CHECK(share(mask_of(triangle, grid)) * 401 * 301 * 0.01 == Approx(area).epsilon(0.005));
  Area disc;
  disc.radius_m = 7.0;
  disc.middle_east_m = 3.0;
  CHECK(share(mask_of(disc, grid)) * 401 * 301 * 0.01 == Approx(pi * 49.0).epsilon(0.005));
  disc.ragged_m = 0.5;
  CHECK(share(mask_of(disc, grid)) * 401 * 301 * 0.01 == Approx(pi * 49.0).epsilon(0.2));
  CHECK(mask_of(disc, grid, 1) != mask_of(disc, grid, 2));
  disc.middle_east_m = 100.0;
  CHECK_THROWS_AS(mask_of(disc, grid), std::invalid_argument);
}

TEST_CASE("A polygon that ends with its first point again holds the same area") {
  const Heightfield grid = flat(101, 101, 0.2, 0.2);
  Area open{.polygon_m = {{-5, -4}, {6, -2}, {3, 7}}}, closed = open;
  closed.polygon_m.push_back(closed.polygon_m.front());
  CHECK(mask_of(closed, grid) == mask_of(open, grid));
}

TEST_CASE("Patches take their share within a per cent, with ragged borders") {
  const Heightfield grid = flat(601, 501, 0.25, 0.25);
  for (const double wanted : {0.1, 0.35, 0.8}) {
    Area area;
    area.share = wanted;
    area.patch_m = 15.0;
    const std::vector<double> mask = mask_of(area, grid);
    CHECK(share(mask) == Approx(wanted).margin(0.01));
    // How often lines to the east cross a border, per metre, seen in steps of some points. Contours
    // that wind about patches of L metres have about 4 / L metres of border in a square metre.
    const auto crossings_per_m = [&](int step) {
      int borders = 0, places = 0;
      for (int row = 0; row < 501; ++row)
        for (int column = 0; column + step < 601; column += step, ++places)
          borders += mask[grid.index(column, row)] != mask[grid.index(column + step, row)];
      return borders / (0.25 * step * places);
    };
    CHECK(crossings_per_m(16) < 4.0 / 15.0);
    // If the border were smooth, finer steps would find hardly more crossings.
    CHECK(crossings_per_m(1) > 1.5 * crossings_per_m(16));
    CHECK(crossings_per_m(1) < 4.0 * crossings_per_m(16));
  }
}

TEST_CASE("A softened mask rises over the width asked for and keeps its amount") {
  const Heightfield grid = flat(400, 9, 0.1, 0.1);
  std::vector<double> mask(grid.z_m.size());
  for (int row = 0; row < 9; ++row)
    for (int column = 0; column < 400; ++column)
      mask[grid.index(column, row)] = column >= 200 && column < 300;
  const std::vector<double> soft = softened(mask, grid, 6.0);
  CHECK(share(soft) == Approx(share(mask)).epsilon(0.01));
  CHECK(soft[grid.index(199, 4)] == Approx(0.5).margin(0.03));
  CHECK(soft[grid.index(165, 4)] == Approx(0.0).margin(1e-12));
  CHECK(soft[grid.index(235, 4)] == Approx(1.0).margin(1e-12));
  double steepest = 0.0;
  for (int column = 0; column + 1 < 300; ++column)
    steepest = std::max(steepest, soft[grid.index(column + 1, 4)] - soft[grid.index(column, 4)]);
  CHECK(steepest < 0.06);  // 6 m are 60 points
  CHECK(softened(mask, grid, 0.0) == mask);
  std::ranges::fill(mask, 1.0);
  CHECK(softened(mask, grid, 6.0) == mask);
}

TEST_CASE("A hole of the bed is no border of an area") {
  Heightfield whole = flat(301, 201, 0.5, 0.5);
  std::ranges::fill(whole.z_m, -20.0);
  Heightfield holed = whole;
  std::uint32_t noise = 1;
  for (double& z_m : holed.z_m)
    if ((noise = noise * 1664525u + 1013904223u) < 0x08000000u)  // 3 %
      z_m = std::numeric_limits<double>::quiet_NaN();
  for (const double border_m : {1.0, 10.0}) {
    CAPTURE(border_m);
    // Without limits a patch raises all of the bed, and all of it has its material.
    SeabedOptions seabed;
    seabed.patches.resize(1);
    seabed.patches[0] = {.area = {.border_m = border_m}, .material = "sandy mud", .rise_m = 1.0};
    Heightfield raised = holed;
    const SeabedMap map = lay_seabed(raised, seabed, "medium sand", 3);
    int wrong = 0;
    for (std::size_t i = 0; i < raised.z_m.size(); ++i)
      wrong += !std::isnan(holed.z_m[i]) &&
               !(raised.z_m[i] == -19.0 && map.kinds[map.point_kind[i]].material == "sandy mud");
    CHECK(wrong == 0);
    // Holes change the weight along a border a little, because its mean is over fewer points.
    const Area half{.polygon_m = {{0.1, -99}, {99, -99}, {99, 99}, {0.1, 99}}};
    const auto weight = [&](const Heightfield& grid) {
      return softened(mask_of(half, grid), grid, border_m);
    };
    const std::vector<double> expected = weight(whole), got = weight(holed);
    double most = 0.0;
    for (std::size_t i = 0; i < got.size(); ++i) {
      const bool beyond_border = expected[i] == 0.0 || expected[i] == 1.0;
      if (std::isnan(holed.z_m[i]))
        wrong += got[i] != 0.0;
      else if (beyond_border)
        wrong += got[i] != expected[i];
      else
        most = std::max(most, std::abs(got[i] - expected[i]));
    }
    CHECK(wrong == 0);
    CHECK(most < 0.25);
  }
}

TEST_CASE("Bands of depth and slope follow the bed") {
  Heightfield grid = flat(200, 100, 0.5, 0.5);
  for (int row = 0; row < 100; ++row)
    for (int column = 0; column < 200; ++column)
      grid.at(column, row) = -20.0 + (column < 100 ? 0.0 : 0.2 * 0.5 * (column - 100));
  Area deep;
  deep.shallowest_m = 15.0;
  const std::vector<double> depth = mask_of(deep, grid);
  CHECK(depth[grid.index(149, 50)] == 1.0);
  CHECK(depth[grid.index(151, 50)] == 0.0);
  Area steep;
  steep.gentlest_rad = std::atan(0.1);
  const std::vector<double> slope = mask_of(steep, grid);
  CHECK(slope[grid.index(90, 50)] == 0.0);
  CHECK(slope[grid.index(110, 50)] == 1.0);
}

TEST_CASE("A band of depths or slopes that the bed has nowhere is refused by name") {
  Heightfield grid = flat(200, 100, 0.5, 0.5);
  for (int row = 0; row < 100; ++row)
    for (int column = 0; column < 200; ++column)
      grid.at(column, row) = -20.0 - 0.05 * column;  // a slope of atan(0.1), to 29.95 m
  const double slope_rad = std::atan(0.1);
  constexpr double little = 1e-6;
  // Bands that only just reach the bed are accepted.
  CHECK(share(mask_of({.shallowest_m = 29.95 - little}, grid)) == Approx(1.0 / 200.0));
  CHECK(share(mask_of({.deepest_m = 20.0 + little}, grid)) == Approx(1.0 / 200.0));
  CHECK(share(mask_of({.gentlest_rad = slope_rad - little}, grid)) > 0.5);
  CHECK(share(mask_of({.steepest_rad = slope_rad + little}, grid)) > 0.9);
  for (const Area& area : {Area{.shallowest_m = 29.95 + little}, Area{.deepest_m = 20.0 - little},
                           Area{.shallowest_m = 22.01, .deepest_m = 22.04}})
    CHECK_THROWS_WITH(mask_of(area, grid),
                      Catch::Contains("an area has depths that the seabed has nowhere") &&
                          Catch::Contains("are 20.00 to 29.95 m"));
  CHECK_THROWS_WITH(mask_of({.gentlest_rad = slope_rad + little}, grid),
                    Catch::Contains("an area has slopes that the seabed has nowhere") &&
                        Catch::Contains(" to 5.71 degrees"));
  // Another window of the same bed may have them.
  grid.whole_columns = 400;
  grid.whole_rows = 100;
  CHECK(share(mask_of({.shallowest_m = 50.0}, grid)) == 0.0);
  CHECK(share(mask_of({.gentlest_rad = 0.5}, grid)) == 0.0);
}

TEST_CASE("Holes of a survey belong to no area") {
  Heightfield grid = flat(20, 20, 1.0, 1.0);
  grid.at(3, 4) = std::numeric_limits<double>::quiet_NaN();
  const std::vector<double> mask = mask_of({}, grid);
  CHECK(mask[grid.index(3, 4)] == 0.0);
  CHECK(share(mask) == Approx(399.0 / 400.0));
}

TEST_CASE("Sides that cross are found, corners that neighbours share are not") {
  CHECK_FALSE(crossing_sides({{0, 0}, {4, 0}, {4, 3}, {0, 3}}));
  CHECK_FALSE(crossing_sides({{0, 0}, {4, 0}, {1, 1}}));
  CHECK_FALSE(crossing_sides({{0, 0}, {4, 0}, {4, 3}, {0, 3}, {0, 0}}));  // closed
  CHECK(crossing_sides({{0, 0}, {4, 3}, {4, 0}, {0, 3}, {0, 0}}));
  const auto bow = crossing_sides({{0, 0}, {4, 3}, {4, 0}, {0, 3}});
  REQUIRE(bow);
  CHECK(bow->first == 0);
  CHECK(bow->second == 2);
  CHECK(crossing_sides({{0, 0}, {4, 0}, {4, 3}, {2, 0}}));  // touches
}

TEST_CASE("Layers add up, and none disturbs another") {
  SeafloorOptions all = options();
  all.seabed.bedforms.resize(2);
  all.seabed.bedforms[0].area.number = 1;
  all.seabed.bedforms[0].relief.wavelength_m = 5.0;
  all.seabed.bedforms[1].area.number = 2;
  all.seabed.bedforms[1].relief.wavelength_m = 2.0;
  all.seabed.bedforms[1].area.share = 0.5;
  all.seabed.pits.resize(1);
  all.seabed.roughness.resize(1);
  all.seabed.trawl_marks.resize(1);
  all.seabed.trawl_marks[0].relief.door_spacing_m = 10.0;
  all.seabed.boulders.resize(1);
  const Heightfield whole = make_heightfield(all, 4);
  const auto relief_of = [](const SeabedOptions& seabed) {
    SeafloorOptions bed = options();
    bed.seabed = seabed;
    Heightfield field = make_heightfield(bed, 4);
    for (double& z : field.z_m) z += 15.0;
    return field.z_m;
  };
  const SeabedOptions& s = all.seabed;
  std::vector<SeabedOptions> alone(6);
  alone[0].bedforms = {s.bedforms[0]};
  alone[1].bedforms = {s.bedforms[1]};
  alone[2].pits = s.pits;
  alone[3].roughness = s.roughness;
  alone[4].trawl_marks = s.trawl_marks;
  alone[5].boulders = s.boulders;
  std::vector<double> sum(whole.z_m.size(), -15.0);
  for (const SeabedOptions& one : alone) {
    const std::vector<double> relief = relief_of(one);
    CHECK(*std::ranges::max_element(relief) - *std::ranges::min_element(relief) > 0.05);
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += relief[i];
  }
  for (std::size_t i = 0; i < sum.size(); ++i)
    REQUIRE(whole.z_m[i] == Approx(sum[i]).margin(1e-12));
}

TEST_CASE("A bed has the same bits on any number of threads") {
  SeafloorOptions bed = options();
  bed.fractal.height_at_1m_m = 0.05;
  bed.ripples = {.rms_height_m = 0.05, .wavelength_m = 3.0};
  bed.seabed.bedforms.resize(2);
  bed.seabed.bedforms[0].relief = {.wavelength_m = 5.0, .raggedness = 0.1, .forks = 3.0};
  bed.seabed.bedforms[1].relief.wavelength_m = 2.0;
  bed.seabed.bedforms[1].area.share = 0.5;
  bed.seabed.roughness.resize(1);
  bed.seabed.outcrops.resize(1);
  bed.seabed.outcrops[0].area.share = 0.3;
  const Heightfield alone = make_heightfield(bed, 4);
  for (const int threads : {2, 3, alone.rows + 1})
    CHECK(make_heightfield(bed, 4, {}, {}, {}, {.threads = threads}).z_m == alone.z_m);
  // This relief is one transform, and a sum over all its terms scales it.
  SeafloorOptions scaled = options();
  scaled.fractal = {.height_at_1m_m = 0.05, .spectrum = FractalSpectrum::paper, .longest_m = 16.0};
  CHECK(make_heightfield(scaled, 4, {}, {}, {}, {.threads = 3}).z_m ==
        make_heightfield(scaled, 4).z_m);
}

TEST_CASE("A bed without patches and layers has the same bits as its base") {
  SeafloorOptions plain = options();
  plain.fractal.height_at_1m_m = 0.05;
  Heightfield direct = flat(241, 161, 0.25, 0.25);
  for (double& z : direct.z_m) z = -15.0;
  add_fractal(direct, plain.fractal, 9);
  CHECK(make_heightfield(plain, 9).z_m == direct.z_m);
  CHECK(make_seafloor(plain, 9).face_label.empty());
}

TEST_CASE("The map's materials and classes reach the faces, and relief follows `on`") {
  SeafloorOptions bed = options();
  bed.seabed.patches.resize(2);
  bed.seabed.patches[0].material = "sandy mud";
  bed.seabed.patches[0].area.polygon_m = {{-31, -21}, {0, -21}, {0, 21}, {-31, 21}};
  bed.seabed.patches[1].material = "seagrass";
  bed.seabed.patches[1].class_name = "seagrass";
  bed.seabed.patches[1].rise_m = 0.3;
  bed.seabed.patches[1].area.radius_m = 6.0;
  bed.seabed.patches[1].area.middle_east_m = 15.0;
  for (Patch& patch : bed.seabed.patches) patch.area.border_m = 0.0;
  bed.seabed.bedforms.resize(1);
  bed.seabed.bedforms[0].area.on = "sandy mud";
  bed.seabed.bedforms[0].area.border_m = 0.0;
  bed.seabed.boulders.resize(1);
  bed.seabed.boulders[0].area.on = "medium sand";
  bed.seabed.boulders[0].relief.per_hectare = 300.0;
  const Seafloor floor = make_seafloor(bed, 2);
  REQUIRE(floor.face_label.size() == floor.bed_faces);
  std::set<std::string> seen;
  double mud = 0.0;
  for (std::uint32_t face = 0; face < floor.bed_faces; ++face) {
    const Label& label = floor.labels[floor.label_of(face)];
    const std::string& material = floor.materials[label.sediment];
    const std::string& name = floor.classes[label.class_id];
    seen.insert(fmt::format("{}/{}", material, name));
    const Eigen::Vector3d p = ensonify::refine::Triangles(floor.mesh).corner(face, 0);
    if (material == "sandy mud") {
      mud += 1.0;
      REQUIRE(p.x() < 0.6);
    }
    if (name == "seagrass") REQUIRE(std::hypot(p.x() - 15.0, p.y()) < 6.6);
    if (name == "boulder") REQUIRE(p.x() > -2.0);
  }
  CHECK(seen == std::set<std::string>{"medium sand/seabed", "sandy mud/seabed", "seagrass/seagrass",
                                      "stone/boulder"});
  CHECK(mud / static_cast<double>(floor.bed_faces) == Approx(0.5).margin(0.01));

  bed.seabed.boulders.clear();
  const Heightfield field = make_heightfield(bed, 2);
  double crests_m = 0.0;
  for (int row = 0; row < field.rows; ++row)
    for (int column = 0; column < field.columns; ++column) {
      const double x = field.x_m(column), z = field.at(column, row) + 15.0;
      if (x > 0.5) REQUIRE((z == 0.0 || std::hypot(x - 15.0, field.y_m(row)) < 7.2));
      if (x < 0.0) crests_m = std::max(crests_m, z);
    }
  CHECK(crests_m > 0.04);
  CHECK(field.at(180, 80) + 15.0 == Approx(0.3));  // the canopy, 15 m to the east
}

TEST_CASE("Boulders have instances, except in a layer with too many of them") {
  SeafloorOptions bed = options();
  bed.seabed.boulders.resize(2);
  bed.seabed.boulders[0].relief.per_hectare = 200.0;
  bed.seabed.boulders[1].relief.per_hectare = 100.0;
  bed.seabed.boulders[1].class_name = "stone";
  const Seafloor floor = make_seafloor(bed, 2);
  CHECK(floor.warnings.empty());
  REQUIRE(floor.features.size() > 30);  // 0.24 ha; the smallest fall between the grid's points
  CHECK(floor.features.size() < 110);
  std::set<std::uint16_t> instances;
  for (const std::uint16_t label : floor.face_label) instances.insert(floor.labels[label].instance);
  instances.erase(0);
  for (std::size_t i = 0; i < floor.features.size(); ++i) {
    const FeatureRecord& feature = floor.features[i];
    CHECK(feature.label.instance == i + 1);
    CHECK(feature.layer ==
          (floor.classes[feature.label.class_id] == "stone" ? "boulders.1" : "boulders.0"));
    CHECK(feature.size_m.head<2>().maxCoeff() < 12.0);
    CHECK(feature.size_m.head<2>().minCoeff() > 0.999 * bed.cell_m);  // that of a single point
  }
  CHECK(instances.size() <= floor.features.size());
  CHECK(static_cast<double>(instances.size()) > 0.9 * static_cast<double>(floor.features.size()));

  bed.cell_m = 0.05;
  bed.seabed.boulders[0].relief = {
      .per_hectare = 90000.0, .diameter_m = 0.2, .scour_ratio = 0.0, .tail_ratio = 0.0};
  bed.extent_east_m = 240.0;
  bed.extent_north_m = 40.0;
  const Seafloor many = make_seafloor(bed, 2);
  REQUIRE(many.warnings.size() == 1);
  CHECK(many.warnings[0].starts_with("seafloor.boulders.0: its "));
  REQUIRE(!many.features.empty());
  CHECK(many.features[0].layer == "boulders.1");
}

TEST_CASE("A feature on two sediments has the one that it mostly lies on") {
  SeafloorOptions bed = options();
  bed.seabed.patches.resize(1);
  bed.seabed.patches[0].material = "sandy mud";
  bed.seabed.patches[0].area.share = 0.5;
  bed.seabed.patches[0].area.patch_m = 6.0;
  bed.seabed.pits.push_back({.relief = {.per_hectare = 300.0, .diameter_m = 5.0}});
  const Seafloor floor = make_seafloor(bed, 2);
  std::map<std::uint16_t, std::map<std::uint16_t, int>> faces;  // by instance and sediment
  for (std::size_t face = 0; face < floor.bed_faces; ++face) {
    const Label& label = floor.labels[floor.face_label[face]];
    if (label.instance != 0) ++faces[label.instance][label.sediment];
  }
  int mixed = 0;
  for (const FeatureRecord& feature : floor.features) {
    int all = 0;
    for (const auto& [sediment, count] : faces[feature.label.instance]) all += count;
    const int its = faces[feature.label.instance][feature.label.sediment];
    CHECK(its >= 0.45 * all);  // of two; points at the edge have no faces
    mixed += its > 0 && its < all;
  }
  CHECK(mixed > 10);
}

TEST_CASE("A softened border is as wide as asked, within a cell") {
  const Heightfield grid = flat(100, 3, 0.5, 0.5);
  std::vector<double> mask(grid.z_m.size());
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 50; column < grid.columns; ++column) mask[grid.index(column, row)] = 1.0;
  for (const double width_m : {0.0, 1.0, 2.0, 3.3, 8.0, 15.0}) {
    CAPTURE(width_m);
    const std::vector<double> soft = softened(mask, grid, width_m);
    const auto between =
        std::ranges::count_if(soft, [](double share) { return share > 0.0 && share < 1.0; });
    CHECK(0.5 * static_cast<double>(between) / grid.rows == Approx(width_m).margin(0.5));
  }
}

TEST_CASE("Across the border of a patch its share falls as a softened mask does") {
  Heightfield field = flat(401, 401, 0.25, 0.25);
  SeabedOptions seabed;
  seabed.patches.resize(1);
  seabed.patches[0].material = "sandy mud";
  seabed.patches[0].area.polygon_m = {{-60, -60}, {0.1, -60}, {0.1, 60}, {-60, 60}};
  seabed.patches[0].area.border_m = 12.0;
  const std::vector<double> weight =
      softened(mask_of(seabed.patches[0].area, field), field, seabed.patches[0].area.border_m);
  const SeabedMap map = lay_seabed(field, seabed, "medium sand", 3);
  for (int column = 170; column <= 230; column += 5) {
    double mud = 0.0;
    for (int row = 0; row < field.rows; ++row)
      mud += map.point_kind[field.index(column, row)] != 0 ? 1.0 / field.rows : 0.0;
    const double expected = weight[field.index(column, 200)];
    CAPTURE(column, expected);
    // Four standard deviations of a share of 401 points.
    CHECK(mud == Approx(expected).margin(0.1));
    if (expected == 0.0 || expected == 1.0) CHECK(mud == Approx(expected).margin(1e-9));
  }
  CHECK(weight[field.index(200, 200)] == Approx(0.5).margin(0.05));
}

TEST_CASE("Ripples lie on the sediment and not on the rock") {
  SeafloorOptions bed = options();
  bed.seabed.outcrops.resize(1);
  bed.seabed.outcrops[0].area.share = 0.4;
  bed.seabed.outcrops[0].area.patch_m = 12.0;
  bed.seabed.outcrops[0].area.border_m = 8.0;
  const Heightfield rock = make_heightfield(bed, 5);
  bed.seabed.bedforms.resize(1);
  bed.seabed.bedforms[0].relief.wavelength_m = 1.5;
  const Heightfield both = make_heightfield(bed, 5);
  int high = 0, rippled = 0;
  for (std::size_t i = 0; i < rock.z_m.size(); ++i) {
    if (rock.z_m[i] > -14.7) {
      ++high;
      REQUIRE(both.z_m[i] == rock.z_m[i]);
    }
    rippled += rock.z_m[i] <= -14.99 && both.z_m[i] != rock.z_m[i];
  }
  CHECK(high > 1000);
  CHECK(rippled > 1000);
}

TEST_CASE("Features that lie between the grid's points are warned of") {
  SeafloorOptions bed = options();
  bed.seabed.pits.push_back({.relief = {.diameter_m = 0.4}});
  bed.seabed.boulders.push_back({.relief = {.diameter_m = 2.0}});
  const std::vector<std::string> warnings = make_seafloor(bed, 1).warnings;
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Catch::Contains("seafloor.pits.0: cells of 0.25 m") &&
                              Catch::Contains("0.1 m or smaller"));
}

TEST_CASE("An error names the layer") {
  SeafloorOptions bed = options();
  bed.seabed.pits.resize(2);
  bed.seabed.pits[1].relief.elongation = 0.1;
  CHECK_THROWS_WITH(
      make_heightfield(bed, 1),
      Catch::Contains("seafloor.pits.1: pits: 'elongation' is 0.1, expected 1 to 20"));
}

TEST_CASE(
    "Each kind of layer has a list and random numbers that no other has, and lies on the bed") {
  std::set<std::string_view> lists;
  std::set<Purpose> purposes{Purpose::seabed_patch};
  const SeabedOptions none;
  for_each_relief_list(none, [&]<class Relief>(const std::vector<ReliefLayer<Relief>>&) {
    const ReliefKind<Relief>& kind = kind_of(Relief{});
    INFO(kind.list);
    CHECK(lists.insert(kind.list).second);
    CHECK(purposes.insert(kind.purpose).second);
    check_relief(Relief{});
    std::set<std::string_view> keys;
    for (const ReliefValue<Relief>& value : kind.values) {
      CHECK(keys.insert(value.key).second);
      CHECK(value.low < value.high);
    }
    SeafloorOptions bed = options();
    for_each_relief_list(bed.seabed, [&](auto& list) {
      if constexpr (std::is_same_v<decltype(list), std::vector<ReliefLayer<Relief>>&>)
        list.resize(1);
    });
    CHECK_FALSE(bed.seabed.empty());
    const std::vector<double> z_m = make_heightfield(bed, 4).z_m;
    CHECK(std::ranges::max(z_m) - std::ranges::min(z_m) > 0.01);
    const Seafloor floor = make_seafloor(bed, 4);
    CHECK(floor.features.empty() == !kind.has_instances());
    for (const FeatureRecord& feature : floor.features)
      CHECK(feature.layer == std::string(kind.list) + ".0");
  });
}

TEST_CASE("An outline in GeoJSON lies in world coordinates, and its holes are holes") {
  const TemporaryFolder folder;
  write_text(
      folder / "area.geojson",
      R"({"type":"FeatureCollection","features":[{"type":"Feature","properties":{},"geometry":
{"type":"Polygon","coordinates":[[[1000,2000],[1010,2000],[1010,2010],[1000,2010],[1000,2000]],
[[1002,2002],[1002,2004],[1004,2004],[1004,2002],[1002,2002]]]}}]})");
  Heightfield grid = flat(201, 201, 0.1, 0.1);
  grid.world_origin = {1005.0, 2005.0, 0.0};
  Area area;
  area.outline.path = folder / "area.geojson";
  CHECK(share(mask_of(area, grid)) * 201 * 201 * 0.01 == Approx(96.0).epsilon(0.02));
  // Where two polygons overlap there is no hole.
  write_text(folder / "area.geojson",
             R"({"type":"MultiPolygon","coordinates":[
[[[1000,2000],[1006,2000],[1006,2006],[1000,2006],[1000,2000]]],
[[[1003,2003],[1009,2003],[1009,2009],[1003,2009],[1003,2003]]]]})");
  CHECK(share(mask_of(area, grid)) * 201 * 201 * 0.01 == Approx(63.0).epsilon(0.02));
  write_text(
      folder / "area.geojson",
      R"({"type":"Polygon","coordinates":[[[3.5,54.5],[3.51,54.5],[3.51,54.51],[3.5,54.5]]]})");
  CHECK_THROWS_WITH(mask_of(area, flat(201, 201, 0.1, 0.1)),
                    Catch::Contains("seems to be in degrees"));
  write_text(folder / "area.geojson", "{ nothing }");
  CHECK_THROWS_WITH(mask_of(area, grid), Catch::Contains("area.geojson"));
}

TEST_CASE("An outline may leave its rings open, and have polygons in collections") {
  const TemporaryFolder folder;
  Heightfield grid = flat(201, 201, 0.1, 0.1);
  grid.world_origin = {1005.0, 2005.0, 0.0};
  Area area;
  area.outline.path = folder / "area.geojson";
  const auto mask = [&](const std::string& geometry) {
    write_text(area.outline.path, geometry);
    return mask_of(area, grid);
  };
  const auto polygon = [](const std::string& last) {
    return R"({"type":"Polygon","coordinates":[[[1000,2000],[1008,2000],[1008,2008],[1000,2008])" +
           last + "]]}";
  };
  const std::vector<double> closed = mask(polygon(",[1000,2000]"));
  CHECK(share(closed) * 201 * 201 * 0.01 == Approx(64.0).epsilon(0.02));
  CHECK(mask(polygon("")) == closed);
  const auto collection = [](const std::string& parts) {
    return R"({"type":"GeometryCollection","geometries":[)" + parts + "]}";
  };
  const std::string point = R"({"type":"Point","coordinates":[1001,2001]})";
  CHECK(mask(collection(point + "," + collection(polygon("")))) == closed);
  CHECK_THROWS_WITH(mask(collection(point)), Catch::Contains("holds no polygon"));
}

TEST_CASE("Outlines of many polygons hold what each of them holds, and can be stopped") {
  const TemporaryFolder folder;
  const auto octagon = [](double east_m, double north_m, double radius_m) {
    std::string ring;
    for (int i = 0; i <= 8; ++i)
      ring += fmt::format("{}[{:.4f},{:.4f}]", i > 0 ? "," : "[",
                          1000.0 + east_m + radius_m * std::cos(0.3 + i % 8 * pi / 4.0),
                          2000.0 + north_m + radius_m * std::sin(0.3 + i % 8 * pi / 4.0));
    return ring + "]";
  };
  Heightfield grid = flat(201, 161, 0.1, 0.1);
  grid.world_origin = {1000.0, 2000.0, 0.0};
  Area area;
  area.outline.path = folder / "area.geojson";
  for (const double ragged_m : {0.0, 0.3}) {
    area.ragged_m = ragged_m;
    std::vector<double> of_each(grid.z_m.size(), 0.0);
    std::string all;
    for (int i = 0; i < 12; ++i) {
      const double east_m = -9.0 + 1.6 * i, north_m = 6.0 * std::sin(2.0 * i);
      const std::string polygon = fmt::format("[{},{}]", octagon(east_m, north_m, 1.7),
                                              octagon(east_m + 0.2, north_m, 0.8));
      all += (i > 0 ? "," : "") + polygon;
      write_text(area.outline.path,
                 fmt::format(R"({{"type":"Polygon","coordinates":{}}})", polygon));
      const std::vector<double> one = mask_of(area, grid);
      for (std::size_t k = 0; k < one.size(); ++k) of_each[k] = std::max(of_each[k], one[k]);
    }
    write_text(area.outline.path,
               fmt::format(R"({{"type":"MultiPolygon","coordinates":[{}]}})", all));
    CHECK(mask_of(area, grid) == of_each);
    CHECK(share(of_each) * 201 * 161 * 0.01 ==
          Approx(12 * 0.5 * 8 * std::sin(pi / 4.0) * (1.7 * 1.7 - 0.8 * 0.8)).epsilon(0.3));
  }
  int rows = 0;
  LayerDraws draws{1, Purpose::seabed_patch, 1};
  draws.control.stop_check = [&] {
    if (++rows == 100) throw std::runtime_error("stopped");
  };
  area.ragged_m = 0.0;
  CHECK_THROWS_WITH(
      area_mask(area, {grid, [](std::size_t, const std::string&) { return true; }}, draws),
      "stopped");
}

TEST_CASE("An area on another map than its survey's is refused") {
  const TemporaryFolder folder;
  Tiff survey;
  survey.columns = survey.rows = 20;
  survey.heights.assign(400, -10.0f);
  write_text(folder / "bed.tif", survey.bytes());  // zone 19
  const Heightfield grid = read_survey(folder / "bed.tif", 0.0);
  Area image, outline;
  image.image.path = folder / "map.tif";
  image.image_value = -10;
  outline.outline.path = folder / "area.geojson";
  const auto write_outline = [&](const std::string& reference) {
    write_text(folder / "area.geojson",
               R"({"type":"FeatureCollection",)" + reference +
                   R"("features":[{"type":"Feature","properties":{},"geometry":{"type":"Polygon",
"coordinates":[[[500000,3999980],[500010,3999980],[500010,4000000],[500000,4000000],
[500000,3999980]]]}}]})");
  };
  const auto crs = [](const std::string& code) {
    return R"("crs":{"type":"name","properties":{"name":"urn:ogc:def:crs:EPSG::)" + code + "\"}},";
  };
  for (const std::uint16_t same : {32619, 26919}) {  // also on NAD83
    survey.epsg = same;
    write_text(folder / "map.tif", survey.bytes());
    CHECK(share(mask_of(image, grid)) == 1.0);
    write_outline(crs(std::to_string(same)));
    CHECK(share(mask_of(outline, grid)) == 0.5);
  }
  write_outline("");
  CHECK(share(mask_of(outline, grid)) == 0.5);
  survey.epsg = 32618;
  write_text(folder / "map.tif", survey.bytes());
  CHECK_THROWS_WITH(mask_of(image, grid),
                    Catch::Contains("map.tif: has another coordinate reference system") &&
                        Catch::Contains("gdalwarp -t_srs"));
  write_outline(crs("32618"));
  CHECK_THROWS_WITH(mask_of(outline, grid),
                    Catch::Contains("area.geojson: has another coordinate reference system") &&
                        Catch::Contains("ogr2ogr -t_srs"));
}

TEST_CASE("An area whose coordinates are not finite is refused") {
  const TemporaryFolder folder;
  const Heightfield grid = flat(20, 20, 1.0, 1.0);
  constexpr double infinite = std::numeric_limits<double>::infinity();
  constexpr double no_number = std::numeric_limits<double>::quiet_NaN();
  Area area;
  area.image.path = folder / "map.tif";
  area.image_value = -10;
  const auto write_map = [&](const std::array<double, 6>& transform) {
    Tiff map;
    map.columns = map.rows = 20;
    map.heights.assign(400, -10.0f);
    map.transform = transform;
    write_text(area.image.path, map.bytes());
  };
  write_map({-20.0, 2.0, 0.0, 20.0, 0.0, -2.0});
  CHECK(share(mask_of(area, grid)) == 1.0);
  for (const std::array<double, 6>& transform :
       {std::array<double, 6>{-20.0, infinite, 0.0, 20.0, 0.0, -2.0},
        {-20.0, 2.0, 0.0, 20.0, 0.0, -infinite},
        {-20.0, 2.0, 0.0, no_number, 0.0, -2.0}}) {
    write_map(transform);
    CHECK_THROWS_WITH(mask_of(area, grid), Catch::Contains("no finite place"));
  }
  write_map({-1.5e308, 1e308, 0.0, 20.0, 0.0, -2.0});  // its eastern edge is beyond all numbers
  CHECK(share(mask_of(area, grid)) == 1.0);

  area = Area();
  area.outline.path = folder / "area.geojson";
  const auto write_outline = [&](const char* x) {
    write_text(
        area.outline.path,
        fmt::format(R"({{"type":"Polygon","coordinates":[[[-5,-5],[{},-5],[5,5],[-5,-5]]]}})", x));
  };
  write_outline("5");
  CHECK(share(mask_of(area, grid)) > 0.0);
  for (const char* x : {"1e999", "NaN", "-Infinity"}) {
    write_outline(x);
    CHECK_THROWS_WITH(mask_of(area, grid), Catch::Contains("not finite numbers"));
  }
}

TEST_CASE("An image lies over the whole seabed, north up, and one that does not fit is refused") {
  const TemporaryFolder folder;
  const auto write_png = [&](std::size_t width, std::size_t height, std::size_t first_marked) {
    Picture picture{.width = width, .height = height, .pixels = {}};
    picture.pixels.assign(width * height, 3);
    for (std::size_t i = first_marked; i < picture.pixels.size(); ++i) picture.pixels[i] = 7;
    const std::vector<std::byte> bytes = encode_png(picture);
    write_text(folder / "map.png",
               std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  };
  const Heightfield grid = flat(301, 201, 0.2, 0.2);
  Area area;
  area.image.path = folder / "map.png";
  area.image_value = 7;
  write_png(30, 20, 300);  // the southern half
  const std::vector<double> mask = mask_of(area, grid);
  CHECK(share(mask) == Approx(0.5).margin(0.005));
  CHECK(mask[grid.index(0, 0)] == 1.0);
  CHECK(mask[grid.index(300, 99)] == 1.0);
  CHECK(mask[grid.index(300, 102)] == 0.0);
  CHECK(mask[grid.index(0, 200)] == 0.0);
  write_png(30, 20, 0);
  area.ragged_m = 8.0;
  CHECK(share(mask_of(area, grid)) == 1.0);  // its border is that of the bed
  area.ragged_m = 0.0;
  area.image_value = 9;
  CHECK_THROWS_WITH(mask_of(area, grid), Catch::Contains("no pixel of the value 9"));
  write_png(20, 20, 100);
  CHECK_THROWS_WITH(mask_of(area, grid), Catch::Contains("proportions"));
  write_text(folder / "map.png", "no picture");
  CHECK_THROWS_AS(mask_of(area, grid), ensonify::refine::MeshError);
}
