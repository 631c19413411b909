#include <ensonify/engine/seafloor/objects/objects.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "support/beds.h"
#include "support/catch.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/seafloor/make_seafloor.h>
#include <ensonify/engine/seafloor/objects/spacing.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/refine/mesh_reader.h>

using namespace ensonify;
using namespace ensonify::engine;
using Eigen::Vector3d, Eigen::Vector3f;
using ensonify::tests::TemporaryFolder;

namespace {

/// One object set down over a bed.
refine::TriangleMesh place_object(const ObjectOptions& object, const refine::TriangleMesh& bed) {
  Seafloor holder;
  holder.mesh = bed;
  holder.bed_faces = bed.faces.size();
  return place_objects({&object, 1}, 1, BedGrid(holder)).objects.front().mesh;
}

/// A closed box with one corner at the origin of its file.
refine::TriangleMesh box(const Vector3f& size) {
  Seafloor holder;
  tests::add_box(holder, Vector3f::Zero(), size);
  return holder.mesh;
}

struct Things {
  TemporaryFolder folder;
  refine::TriangleMesh bed = tests::level_bed(20.0, 50.0).mesh;

  ObjectOptions object(const refine::TriangleMesh& mesh) const {
    refine::write_ply(folder / "thing.ply", mesh);
    ObjectOptions options;
    options.mesh = {"thing.ply", folder / "thing.ply"};
    return options;
  }
  refine::Bounds placed(const ObjectOptions& options) const {
    return refine::bounds(place_object(options, bed));
  }
};

void check_box(const refine::Bounds& found, Vector3d lowest, Vector3d highest) {
  for (int axis = 0; axis < 3; ++axis) {
    CAPTURE(axis);
    CHECK(found.lowest[axis] == Approx(lowest[axis]).margin(1e-5));
    CHECK(found.highest[axis] == Approx(highest[axis]).margin(1e-5));
  }
}

}  // namespace

TEST_CASE(
    "An object stands on the bed, floats above it or is sunk into it, its middle at its place") {
  const Things things;
  ObjectOptions options = things.object(box({2, 4, 1}));
  options.east_m = 10.0;
  options.north_m = -5.0;
  check_box(things.placed(options), {9, -7, -20}, {11, -3, -19});
  options.height_m = 3.0;
  check_box(things.placed(options), {9, -7, -17}, {11, -3, -16});
  options.height_m = -0.25;
  check_box(things.placed(options), {9, -7, -20.25}, {11, -3, -19.25});
}

TEST_CASE("An object is scaled, and turned clockwise, then nose up, then to starboard") {
  const Things things;
  refine::TriangleMesh bow = box({2, 4, 1});
  constexpr std::size_t tip = 8;
  bow.positions.emplace_back(1.0f, 7.0f, 0.5f);  // a spike to the front, y
  bow.faces.push_back({2, 3, tip});
  ObjectOptions options = things.object(bow);
  options.scale = 0.5;
  check_box(things.placed(options), {-0.5, -1.75, -20}, {0.5, 1.75, -19.5});
  options.heading_rad = 90.0 * degree;
  const refine::TriangleMesh turned = place_object(options, things.bed);
  check_box(refine::bounds(turned), {-1.75, -0.5, -20}, {1.75, 0.5, -19.5});
  CHECK(turned.positions[tip].x() == Approx(1.75));  // the bow points east

  options.pitch_rad = 90.0 * degree;  // the bow up
  const refine::TriangleMesh lifted = place_object(options, things.bed);
  CHECK(lifted.positions[tip].z() == Approx(-20.0 + 3.5));

  options = things.object(box({2, 4, 1}));
  options.roll_rad = 90.0 * degree;  // the x side down
  const refine::TriangleMesh rolled = place_object(options, things.bed);
  check_box(refine::bounds(rolled), {-0.5, -2, -20}, {0.5, 2, -18});
  CHECK(rolled.positions[0].z() == Approx(-18.0));  // the corner at x = 0 came up
}

TEST_CASE("A plate rests on a rock that meets it between its corners") {
  Things things;
  //        /\          a pyramid of 1 m under the plate's middle
  const auto first = static_cast<std::uint32_t>(things.bed.positions.size());
  for (const Vector3f& p :
       {Vector3f{-1, -1, -20}, {1, -1, -20}, {1, 1, -20}, {-1, 1, -20}, {0, 0, -19}})
    things.bed.positions.push_back(p);
  for (std::uint32_t k = 0; k < 4; ++k)
    things.bed.faces.push_back({first + k, first + (k + 1) % 4, first + 4});
  check_box(things.placed(things.object(box({10, 10, 0.5}))), {-5, -5, -19}, {5, 5, -18.5});
}

TEST_CASE("An object without a bed below it is refused by its file and place") {
  const Things things;
  ObjectOptions options = things.object(box({2, 4, 1}));
  options.east_m = 70.0;
  CHECK_THROWS_WITH(place_object(options, things.bed),
                    Catch::Contains("thing.ply: there is no bed below this object at 70.0 m east"));
}

TEST_CASE("Objects are added to the seafloor after the bed, and each face has its object's label") {
  const Things things;
  SeafloorOptions bed;
  bed.extent_east_m = bed.extent_north_m = 20.0;
  bed.cell_m = 1.0;
  const Seafloor bare = make_seafloor(bed, 1);

  std::vector<ObjectOptions> objects(3, things.object(box({1, 1, 1})));
  objects[0].class_name = objects[2].class_name = "crate";
  objects[0].east_m = -5.0;
  objects[1].class_name = "pipe";
  objects[1].material = "concrete";
  objects[2].east_m = 5.0;
  const Seafloor seafloor = make_seafloor(bed, 1, objects);

  REQUIRE(seafloor.bed_faces == bare.mesh.faces.size());
  REQUIRE(seafloor.mesh.faces.size() == bare.mesh.faces.size() + 3 * 12);
  CHECK(std::equal(bare.mesh.faces.begin(), bare.mesh.faces.end(), seafloor.mesh.faces.begin()));
  CHECK(seafloor.classes == std::vector<std::string>{"none", "seabed", "crate", "pipe"});
  const auto label = [&](std::size_t face) {
    return seafloor.labels[seafloor.label_of(static_cast<std::uint32_t>(face))];
  };
  CHECK(label(0).class_id == 1);
  CHECK(label(0).instance == 0);
  CHECK(seafloor.materials.at(label(0).sediment) != "none");
  for (std::size_t i = 0; i < 3; ++i)
    for (const std::size_t face : {12 * i, 12 * i + 11}) {
      const Label of = label(seafloor.bed_faces + face);
      CHECK(of.instance == i + 1);
      CHECK(seafloor.classes.at(of.class_id) == objects[i].class_name);
      CHECK(seafloor.materials.at(of.sediment) == objects[i].material);
      const Vector3d corner = refine::Triangles(seafloor.mesh)
                                  .corner(static_cast<std::uint32_t>(seafloor.bed_faces + face), 0);
      CHECK(std::abs(corner.x() - objects[i].east_m) == Approx(0.5));
    }
}

TEST_CASE(
    "A mesh becomes a seafloor: its heights are relative to the water level, wherever it lies") {
  const TemporaryFolder folder;
  Seafloor origin;
  for (const double shift : {0.0, 6.2e6, 1e7}) {
    refine::TriangleMesh hill;
    hill.world_origin = {shift / 10.0, shift, 372.0};
    hill.positions = {{-9.25f, -9, 1}, {9, -9, 1.5f}, {9, 9, 1}, {-9, 9, 1}, {0.125f, 0, 3}};
    hill.faces = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
    refine::write_ply(folder / "hill.ply", hill);
    SeafloorOptions options;
    options.kind = SeafloorKind::mesh;
    options.mesh.path = folder / "hill.ply";
    options.water_level_m = 380.5;
    const Seafloor seafloor = make_seafloor(options, 1);
    CHECK(seafloor.mesh.faces == hill.faces);
    CHECK(seafloor.mesh.world_origin == Vector3d(shift / 10.0, shift, 380.5));
    CHECK(seafloor.mesh.positions[4].z() == Approx(375.0 - 380.5));
    CHECK(seafloor.warnings.empty());
    if (shift == 0.0)
      origin = seafloor;
    else
      for (std::size_t i = 0; i < hill.positions.size(); ++i)
        CHECK((seafloor.mesh.positions[i] - origin.mesh.positions[i]).norm() < 1e-6f);

    Scene scene;
    scene.seafloor = options;
    scene.seafloor.water_level_m = 300.0;
    CHECK_THROWS_WITH(Simulator(scene),
                      Catch::Contains("hill.ply: the whole mesh lies above the sea surface"));
    CHECK_THROWS_WITH(make_heightfield(options, 1), Catch::Contains("no grid of heights"));
  }
}

TEST_CASE("a mesh bed higher or deeper than any on Earth is refused: it is not in metres") {
  const TemporaryFolder folder;
  refine::TriangleMesh millimetres;
  millimetres.positions = {{-9000, -9000, -18000}, {9000, -9000, -18500}, {0, 9000, -18000}};
  millimetres.faces = {{0, 1, 2}};
  refine::write_ply(folder / "bed.ply", millimetres);
  SeafloorOptions options;
  options.kind = SeafloorKind::mesh;
  options.mesh.path = folder / "bed.ply";
  CHECK_THROWS_WITH(make_seafloor(options, 1),
                    Catch::Contains("bed.ply: has a height of -18000 m; is it in millimetres"));
}

TEST_CASE("discs of any size keep their distance, as a check of each pair shows") {
  Layout layout;
  std::vector<Disc> taken;
  std::size_t free = 0, refused = 0;
  // Up to discs of a thousand kilometres, which would cover 1e11 cells.
  const RandomStream draws(1, Purpose::object_place, {0, 0, 0});
  for (std::uint64_t i = 0; i < 3000; ++i) {
    std::array<double, 4> drawn{};
    draws.uniform(drawn, 4 * i);
    const double extent_m = std::pow(10.0, 1.0 + 6.0 * drawn[0]);
    const Disc disc{{extent_m * (drawn[1] - 0.5), extent_m * (drawn[2] - 0.5)},
                    0.1 * extent_m * drawn[3]};
    const double gap_m = i % 3 == 0 ? 1.0 : 0.0;
    const bool expected = std::ranges::all_of(taken, [&](const Disc& other) {
      return (disc.middle - other.middle).norm() >= disc.radius_m + other.radius_m + gap_m;
    });
    REQUIRE(layout.is_free({&disc, 1}, gap_m) == expected);
    ++(expected ? free : refused);
    if (!expected) continue;
    layout.take({&disc, 1});
    taken.push_back(disc);
  }
  CHECK(free > 20);
  CHECK(refused > 100);
}

TEST_CASE("an object of a million metres is set down like any other, with a warning") {
  const Things things;
  SeafloorOptions level;
  level.extent_east_m = level.extent_north_m = 20.0;
  level.cell_m = 0.25;
  level.fractal.height_at_1m_m = 0.0;
  const Seafloor floor = make_seafloor(level, 1);
  const BedGrid bed(floor);
  for (const Vector3f& size : {Vector3f(1e6f, 1.0f, 1.0f), Vector3f(1e6f, 1e6f, 1.0f)}) {
    ObjectOptions options = things.object(box(size));
    options.east_m = 3.0;
    const PlacedObjects placed = place_objects({&options, 1}, 1, bed);
    CHECK(placed.warnings.size() == 1);
    check_box(refine::bounds(placed.objects.front().mesh),
              {3.0 - 0.5 * size.x(), -0.5 * size.y(), -20.0},
              {3.0 + 0.5 * size.x(), 0.5 * size.y(), -19.0});
  }
}

TEST_CASE("for an object with a misplaced vertex the warning names that vertex") {
  const Things things;
  refine::TriangleMesh astray = box({1.0f, 1.0f, 1.0f});
  astray.world_origin = {500000.0, 4600000.0, 0.0};
  things.placed(things.object(astray));
  astray.positions[5] = (-astray.world_origin).cast<float>();
  CHECK_THROWS_WITH(things.placed(things.object(astray)),
                    Catch::Contains("thing.ply: is 4.6e+06 m long") &&
                        Catch::Contains("vertex 5 (from 0) is the farthest") &&
                        Catch::Contains("there is no bed below this object"));
}

TEST_CASE("a mesh in millimetres is as large as its scale says, also for the warning") {
  const Things things;
  ObjectOptions options = things.object(box({120e3f, 10e3f, 1.0f}));
  const auto place = [&] {
    Seafloor holder;
    holder.mesh = tests::level_bed(20.0, 1e6).mesh;
    holder.bed_faces = holder.mesh.faces.size();
    return place_objects({&options, 1}, 1, BedGrid(holder));
  };
  CHECK(place().warnings.size() == 1);
  options.scale = 0.001;
  CHECK(place().warnings.empty());
}

TEST_CASE("a chain that is too short for a link is refused") {
  const Things things;
  ObjectOptions options;
  options.shape = "chain";
  options.path = {{0.0, 0.0}, {0.09, 0.0}};  // half a link is 0.1 m
  CHECK_THROWS_WITH(place_object(options, things.bed),
                    Catch::Contains("objects.0 (chain): its 0.09 m are too short for a link"));
  options.path[1].x() = 0.11;
  CHECK(!place_object(options, things.bed).faces.empty());
}

TEST_CASE("a line of too many pieces is refused before it occupies its place") {
  const Things things;
  ObjectOptions options;
  options.shape = "cable";
  options.path = {{-1e7, 0.0}, {1e7, 0.0}};
  CHECK_THROWS_WITH(place_object(options, things.bed), Catch::Contains("make it shorter"));
}
