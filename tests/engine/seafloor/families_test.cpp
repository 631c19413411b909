// Shapes whose form is drawn: wrecks, aircraft and others.
#include <algorithm>
#include <map>
#include <memory>
#include <numbers>
#include <numeric>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <xxhash.h>

#include "support/beds.h"
#include "support/catch.h"

#include <ensonify/engine/seafloor/objects/objects.h>
#include <ensonify/engine/seafloor/objects/shapes.h>
#include <ensonify/refine/mesh_repair.h>

using namespace ensonify;
using namespace ensonify::engine;
using Eigen::Vector3d;

namespace {

constexpr std::uint64_t seeds = 12;

std::vector<const ShapeKind*> families() {
  std::vector<const ShapeKind*> all;
  for (const ShapeKind& kind : shape_kinds())
    if (kind.family) all.push_back(&kind);
  return all;
}

ShapeBody member(const ShapeKind& kind, std::uint64_t seed, std::string_view variant = "",
                 const ShapeSize& size = {}) {
  return make_body(kind, size, RandomStream(seed, Purpose::object_shape, {0, 0}), variant);
}

/// Calls f(kind, variant, seed, body) for members of every variant of a kind.
template <class F>
void for_each_member(const ShapeKind& kind, std::uint64_t count, F&& f) {
  std::vector<std::string_view> variants = kind.variants;
  if (variants.empty()) variants.emplace_back("");
  for (const std::string_view variant : variants)
    for (std::uint64_t seed = 1; seed <= count; ++seed) {
      CAPTURE(kind.name, variant, seed);
      f(kind, variant, seed, member(kind, seed, variant));
    }
}

/// The same for every family.
template <class F>
void for_each_member(std::uint64_t count, F&& f) {
  for (const ShapeKind* kind : families()) for_each_member(*kind, count, f);
}

Vector3d extent_of(const refine::TriangleMesh& mesh) {
  const refine::Bounds box = refine::bounds(mesh);
  return (box.highest - box.lowest).cast<double>();
}

/// The faces of each closed surface of a mesh: those that are connected by vertices.
std::vector<std::vector<std::uint32_t>> surfaces_of(const refine::TriangleMesh& mesh) {
  std::vector<std::uint32_t> root(mesh.positions.size());
  std::iota(root.begin(), root.end(), 0u);
  const auto find = [&](std::uint32_t v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  for (const refine::Face& face : mesh.faces)
    for (const std::uint32_t v : face) root[find(v)] = find(face[0]);
  std::map<std::uint32_t, std::vector<std::uint32_t>> by_root;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f)
    by_root[find(mesh.faces[f][0])].push_back(f);
  std::vector<std::vector<std::uint32_t>> surfaces;
  for (auto& [vertex, faces] : by_root) surfaces.push_back(std::move(faces));
  return surfaces;
}

double volume_of_part_m3(const refine::TriangleMesh& mesh,
                         const std::vector<std::uint32_t>& faces) {
  const refine::Triangles triangles = mesh;
  const Vector3d about = triangles.corner(faces.front(), 0);
  double volume = 0.0;
  for (const std::uint32_t f : faces)
    volume += (triangles.corner(f, 0) - about)
                  .dot((triangles.corner(f, 1) - about).cross(triangles.corner(f, 2) - about)) /
              6.0;
  return volume;
}

/// Where a vertical line meets faces: height, and whether it leaves the body there (normal up).
std::vector<std::pair<double, bool>> crossings(const refine::TriangleMesh& mesh,
                                               const std::vector<std::uint32_t>& faces, double x,
                                               double y) {
  const refine::Triangles triangles = mesh;
  std::vector<std::pair<double, bool>> met;
  for (const std::uint32_t f : faces) {
    const Vector3d a = triangles.corner(f, 0), b = triangles.corner(f, 1),
                   c = triangles.corner(f, 2);
    const auto side = [&](const Vector3d& p, const Vector3d& q) {
      return (q.x() - p.x()) * (y - p.y()) - (q.y() - p.y()) * (x - p.x());
    };
    const double ab = side(a, b), bc = side(b, c), ca = side(c, a);
    const bool up = ab > 0.0 && bc > 0.0 && ca > 0.0, down = ab < 0.0 && bc < 0.0 && ca < 0.0;
    if (!up && !down) continue;
    met.emplace_back((bc * a.z() + ca * b.z() + ab * c.z()) / (ab + bc + ca), up);
  }
  std::ranges::sort(met);
  return met;
}

}  // namespace

TEST_CASE("Members of families are closed and manifold, with normals outwards", "[slow]") {
  for_each_member(seeds,
                  [](const ShapeKind&, std::string_view, std::uint64_t, const ShapeBody& body) {
                    const refine::TriangleMesh& mesh = body.mesh;
                    REQUIRE(mesh.faces.size() > 50);
                    REQUIRE(mesh.faces.size() < 50000);
                    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
                    for (const refine::Face& face : mesh.faces)
                      for (std::size_t k = 0; k < 3; ++k)
                        edges.emplace_back(face[k], face[(k + 1) % 3]);
                    std::ranges::sort(edges);
                    REQUIRE(std::ranges::adjacent_find(edges) == edges.end());
                    for (const auto& [from, to] : edges)
                      if (!std::ranges::binary_search(edges, std::pair(to, from)))
                        FAIL("an open edge");
                    const refine::RepairedMesh repaired = refine::repair(mesh, -1.0);
                    CHECK(repaired.report.total() == 0);
                    for (const std::vector<std::uint32_t>& surface : surfaces_of(mesh))
                      CHECK(volume_of_part_m3(mesh, surface) > 0.0);
                    CHECK(refine::encloses_volume(mesh));
                  });
}

TEST_CASE("No surface of a family's member meets itself", "[slow]") {
  // Along a line that crosses a closed surface without self-intersections, ways in and ways out
  // alternate.
  for_each_member(
      4, [](const ShapeKind&, std::string_view, std::uint64_t seed, const ShapeBody& body) {
        std::size_t lines = 0, wrong = 0;
        for (const std::vector<std::uint32_t>& surface : surfaces_of(body.mesh)) {
          Eigen::AlignedBox2d box;
          for (const std::uint32_t f : surface)
            for (const std::uint32_t v : body.mesh.faces[f])
              box.extend(body.mesh.positions[v].head<2>().cast<double>().eval());
          constexpr int side = 9;
          std::vector<double> u(2);
          for (int i = 0; i < side * side; ++i) {
            RandomStream(seed, Purpose::test, {surface.front(), 0, 0})
                .uniform(u, static_cast<std::uint64_t>(2 * i));
            const Eigen::Vector2d at =
                box.min() + box.sizes().cwiseProduct(Eigen::Vector2d(u[0], u[1]));
            const auto met = crossings(body.mesh, surface, at.x(), at.y());
            lines += !met.empty();
            bool bad = met.size() % 2 != 0;
            for (std::size_t k = 0; k < met.size(); ++k) bad = bad || met[k].second != (k % 2 == 1);
            wrong += bad;
          }
        }
        REQUIRE(lines > 50);
        CHECK(wrong == 0);
      });
}

TEST_CASE("A family's member has exactly the sizes that are given") {
  for (const ShapeKind* kind : families()) {
    if (kind->name == "cable_drum") continue;  // the width of one that lies is its height
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      CAPTURE(kind->name, seed);
      ShapeSize size;
      Vector3d expected = Vector3d::Zero();
      for (const Dimension& dimension : kind->dimensions) {
        const bool length = dimension.size == &ShapeSize::length_m;
        const bool tall = dimension.size == &ShapeSize::shape_height_m;
        const bool round = dimension.size == &ShapeSize::diameter_m;
        const bool long_and_round = round && kind->dimensions.front().size != dimension.size;
        const double given = length ? 7.5 : tall ? 2.0 : round ? 1.25 : 3.0;
        size.*dimension.size = given;
        expected[length ? 1 : tall ? 2 : round && !long_and_round ? 1 : 0] = given;
      }
      const Vector3d extent = extent_of(member(*kind, seed, "", size).mesh);
      for (Eigen::Index axis = 0; axis < 3; ++axis)
        if (expected[axis] > 0.0) CHECK(extent[axis] == Approx(expected[axis]).epsilon(1e-5));
    }
  }
}

TEST_CASE("A family's member is finite at the smallest and the largest size of a scene") {
  for (const ShapeKind* kind : families())
    for (const double size_m : {0.001, 1000.0})
      for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        CAPTURE(kind->name, size_m, seed);
        ShapeSize size;
        size.*kind->dimensions.front().size = size_m;
        CHECK(std::ranges::all_of(member(*kind, seed, "", size).mesh.positions,
                                  [](const Eigen::Vector3f& p) { return p.allFinite(); }));
      }
}

TEST_CASE("A cable drum is as wide along its axle as is given, standing or lying, and round") {
  const ShapeKind& kind = shape_named("cable_drum");
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    CAPTURE(seed);
    ShapeSize size;
    size.diameter_m = 2.0;
    size.width_m = 0.9;
    const Vector3d standing = extent_of(member(kind, seed, "standing", size).mesh);
    CHECK(standing.x() == Approx(0.9).epsilon(1e-5));
    CHECK(standing.y() == Approx(2.0).epsilon(1e-5));
    const Vector3d lying = extent_of(member(kind, seed, "lying", size).mesh);
    CHECK(lying.z() == Approx(0.9).epsilon(1e-5));
    CHECK(lying.y() == Approx(2.0).epsilon(1e-5));
    CHECK(lying.x() == Approx(2.0).epsilon(0.15));  // it leans a little
  }
}

TEST_CASE("A mannequin lies on the bed in every posture") {
  // On a side its shoulders are 0.3 of its length wide; on the back raised knees are as high.
  for_each_member(shape_named("mannequin"), 60,
                  [](const ShapeKind&, std::string_view, std::uint64_t, const ShapeBody& body) {
                    const Vector3d extent = extent_of(body.mesh);
                    CHECK(extent.z() < 0.36 * std::max(extent.x(), extent.y()));
                  });
}

TEST_CASE("A family draws its main size from the range that is listed") {
  for (const ShapeKind* kind : families()) {
    const Dimension& main = kind->dimensions.front();
    if (!(main.max_m > 0.0)) continue;
    CAPTURE(kind->name);
    double least = 1e9, most = 0.0;
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
      const Vector3d extent = extent_of(member(*kind, seed).mesh);
      const double size_m = main.size == &ShapeSize::shape_height_m ? extent.z() : extent.y();
      least = std::min(least, size_m);
      most = std::max(most, size_m);
    }
    CHECK(least >= main.usual_m * (1.0 - 1e-5));
    CHECK(most <= main.max_m * (1.0 + 1e-5));
    CHECK(most / least > 0.7 * main.max_m / main.usual_m);
  }
}

TEST_CASE("Another seed makes another member, and the same seed the same bytes") {
  for (const ShapeKind* kind : families()) {
    CAPTURE(kind->name);
    std::set<std::vector<float>> forms;
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      const ShapeBody one = member(*kind, seed), again = member(*kind, seed);
      REQUIRE(one.mesh.positions == again.mesh.positions);
      REQUIRE(one.mesh.faces == again.mesh.faces);
      REQUIRE(one.face_part == again.face_part);
      std::vector<float> numbers;
      for (const Eigen::Vector3f& p : one.mesh.positions)
        numbers.insert(numbers.end(), p.data(), p.data() + 3);
      forms.insert(numbers);
    }
    CHECK(forms.size() == seeds);
  }
}

TEST_CASE("All compilers make the same members") {
  // Hashes of what GCC 12 made.
  const std::map<std::string_view, std::uint64_t> expected{
      {"net", 0x29f5c25c3f391322},        {"boulder", 0x1ed0bf1d6d0c748c},
      {"debris", 0x31a4cbd976149f92},     {"wreck", 0xfc208dbb4683459b},
      {"aircraft", 0x1278e04843a981d7},   {"boat", 0x1c71602bdf420baf},
      {"car", 0x2bed380941cc60ad},        {"container", 0xf501fe6a4a9862d5},
      {"cable_drum", 0xb4f8899d7d292d41}, {"ladder", 0xac3cfcec6b6f6329},
      {"mooring", 0xc4a173d9a97c2c18},    {"mannequin", 0xf68f89a60a97d6c5},
      {"ordnance", 0x0b2dca4eb2a0b6cf},   {"mine", 0xfcc2a45224b2bb6b},
  };
  std::map<std::string_view, std::uint64_t> made;
  for (const auto& [name, hash] : expected) {
    const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(),
                                                                         XXH3_freeState);
    XXH3_64bits_reset(state.get());
    const auto add = [&](const auto& values) {
      const auto bytes = std::as_bytes(std::span(values));
      XXH3_64bits_update(state.get(), bytes.data(), bytes.size());
    };
    for_each_member(shape_named(name), seeds,
                    [&](const ShapeKind&, std::string_view, std::uint64_t, const ShapeBody& body) {
                      add(body.mesh.positions);
                      add(body.mesh.faces);
                      add(body.face_part);
                    });
    made[name] = XXH3_64bits_digest(state.get());
  }
  for (const auto& [name, hash] : made) {
    INFO(fmt::format("{}: {:#018x}", name, hash));
    CHECK(hash == expected.at(name));
  }
}

TEST_CASE("Variants are drawn, or chosen, and others are refused", "[slow]") {
  const ShapeKind& wreck = shape_named("wreck");
  CHECK(member(wreck, 3, "broken").mesh.positions != member(wreck, 3, "frames").mesh.positions);
  std::set<std::size_t> found;
  for (std::uint64_t seed = 1; seed <= 60; ++seed)
    for (std::size_t v = 0; v < wreck.variants.size(); ++v)
      if (member(wreck, seed).mesh.positions ==
          member(wreck, seed, wreck.variants[v]).mesh.positions)
        found.insert(v);
  CHECK(found.size() == wreck.variants.size());
  CHECK_THROWS_WITH(member(wreck, 1, "biplane"), Catch::Contains("has no variant 'biplane'"));
}

TEST_CASE("Every part that a family lists is made by some of its members, and no other") {
  for (const ShapeKind* kind : families()) {
    CAPTURE(kind->name);
    std::set<std::size_t> found;
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
      const ShapeBody body = member(*kind, seed);
      if (body.face_part.empty()) {
        found.insert(0);
        continue;
      }
      REQUIRE(body.face_part.size() == body.mesh.faces.size());
      found.insert(body.face_part.begin(), body.face_part.end());
    }
    CHECK(found.size() == kind->parts.size());
    CHECK(*found.rbegin() + 1 == kind->parts.size());
  }
}

TEST_CASE("The parts of an object have their materials, and with part_classes their classes") {
  ObjectOptions wreck;
  wreck.shape = "wreck";
  wreck.variant = "upright";
  wreck.size.length_m = 30.0;
  wreck.shape_seed = 2;
  wreck.class_name = "ship";
  wreck.material = "steel";
  const Seafloor floor = tests::level_bed(50.0, 100.0);
  const BedGrid bed(floor);
  const auto placed = [&] { return place_objects(std::span(&wreck, 1), 1, bed).objects.front(); };
  const PlacedObjects::One plain = placed();
  std::set<std::string> materials;
  for (const ObjectPart& part : plain.parts) {
    CHECK(part.class_name == "ship");
    CHECK_FALSE(part.two_sided);
    materials.insert(part.material);
  }
  CHECK(plain.parts.front().material == "steel");
  CHECK(materials.count("wood") == 1);
  REQUIRE(plain.face_part.size() == plain.mesh.faces.size());

  wreck.part_classes = true;
  const PlacedObjects::One parted = placed();
  CHECK(parted.mesh.positions == plain.mesh.positions);
  CHECK(parted.parts.front().class_name == "ship");
  std::map<std::string, std::string> material_of;
  for (std::size_t f = 0; f < parted.face_part.size(); ++f) {
    const ObjectPart& part = parted.parts[parted.face_part[f]];
    material_of[part.class_name] = part.material;
    CHECK(part.material == plain.parts[plain.face_part[f]].material);
  }
  CHECK(material_of.at("ship.hull") == "steel");
  CHECK(material_of.at("ship.deck") == "wood");
}

TEST_CASE("A shape that is meant to be sunk in is set down so") {
  const Seafloor floor = tests::level_bed(50.0, 100.0);
  const BedGrid bed(floor);
  ObjectOptions wreck;
  wreck.shape = "wreck";
  wreck.shape_seed = 5;
  wreck.size.length_m = 20.0;
  const double sunk_m = member(shape_named("wreck"), 5, "", wreck.size).sunk_m;
  REQUIRE(sunk_m > 0.05);
  const auto lowest_m = [&] {
    return double(
        refine::bounds(place_objects(std::span(&wreck, 1), 1, bed).objects[0].mesh).lowest.z());
  };
  CHECK(lowest_m() == Approx(-50.0 - sunk_m).margin(1e-3));
  wreck.height_m = -1.0;
  CHECK(lowest_m() == Approx(-51.0 - sunk_m).margin(1e-3));
  wreck.scale = 2.0;
  CHECK(lowest_m() == Approx(-51.0 - 2.0 * sunk_m).margin(1e-3));
}

TEST_CASE("A given burial or height holds for a shape that otherwise sinks in by itself") {
  const Seafloor floor = tests::level_bed(50.0, 100.0);
  const BedGrid bed(floor);
  for (const ShapeKind* kind : families()) {
    if (kind->several) continue;
    CAPTURE(kind->name);
    ObjectOptions object;
    object.shape = kind->name;
    object.shape_seed = 3;
    const auto placed = [&] {
      return place_objects(std::span(&object, 1), 1, bed).objects.front();
    };
    CHECK(placed().record.buried > 0.01);
    object.burial = 0.0;
    CHECK(placed().record.buried == Approx(0.0).margin(1e-4));
    object.burial = 0.4;
    CHECK(placed().record.buried == Approx(0.4).margin(0.01));
    object.burial.reset();
    object.height_m = -0.02;
    CHECK(refine::bounds(placed().mesh).lowest.z() == Approx(-50.02).margin(1e-4));
  }
}

TEST_CASE("shape_seed gives the same form in every table and scene, and copies that differ") {
  const Seafloor floor = tests::level_bed(50.0, 100.0);
  const BedGrid bed(floor);
  ObjectOptions boat;
  boat.shape = "boat";
  boat.shape_seed = 9;
  ObjectOptions other = boat;
  other.east_m = 40.0;
  const std::vector<ObjectOptions> two{boat, other};
  const auto faces_and_size = [&](std::uint64_t seed, std::size_t number) {
    const PlacedObjects::One one = place_objects(two, seed, bed).objects[number];
    return std::pair(one.mesh.faces, one.record.size_m.norm());
  };
  const auto first = faces_and_size(1, 0);
  for (const auto& [seed, number] : {std::pair(1, 1), std::pair(2, 0), std::pair(7, 1)}) {
    const auto same =
        faces_and_size(static_cast<std::uint64_t>(seed), static_cast<std::size_t>(number));
    CHECK(same.first == first.first);
    CHECK(same.second == Approx(first.second).epsilon(1e-5));
  }
  boat.count = 2;
  const PlacedObjects copies = place_objects(std::span(&boat, 1), 1, bed);
  CHECK(copies.objects[0].record.size_m.norm() != copies.objects[1].record.size_m.norm());
}

TEST_CASE("An assembly is one object: turned, scaled, sunk in and labelled as one") {
  const Seafloor floor = tests::level_bed(50.0, 100.0);
  const BedGrid bed(floor);
  ObjectOptions base;
  base.shape = "box";
  base.class_name = "site";
  base.material = "concrete";
  base.assembly = "site";
  base.size.length_m = 4.0;
  base.size.width_m = 2.0;
  base.size.shape_height_m = 1.0;
  ObjectOptions crate;  // on top of it, at its end
  crate.shape = "box";
  crate.class_name = "crate";
  crate.material = "wood";
  crate.assembly = "site";
  crate.size.length_m = crate.size.width_m = 1.0;
  crate.size.shape_height_m = 0.5;
  crate.north_m = 1.5;
  crate.height_m = 1.0;
  crate.scale = 0.5;
  ObjectOptions alone;
  alone.shape = "sphere";
  alone.east_m = 30.0;
  std::vector<ObjectOptions> tables{base, alone, crate};
  CHECK(count_of(tables) == 2);
  CHECK(bases_of(tables) == std::vector<std::size_t>{0, 1, 0});
  PlacedObjects placed = place_objects(tables, 1, bed);
  REQUIRE(placed.objects.size() == 2);
  const PlacedObjects::One& site = placed.objects.front();
  CHECK(site.record.table == 0);
  CHECK((site.record.size_m - Vector3d(2.0, 4.0, 1.25)).norm() < 1e-4);
  REQUIRE(site.parts.size() == 2);
  CHECK(site.parts[0] == ObjectPart{"site", "concrete", false});
  CHECK(site.parts[1] == ObjectPart{"site", "wood", false});
  // The crate, 0.5 x 0.5 x 0.25 m, stands on the box.
  Eigen::AlignedBox3d box;
  for (std::size_t f = 0; f < site.face_part.size(); ++f)
    if (site.face_part[f] == 1)
      for (const std::uint32_t v : site.mesh.faces[f])
        box.extend(site.mesh.positions[v].cast<double>().eval());
  CHECK((box.min() - Vector3d(-0.25, 1.25, -49.0)).norm() < 1e-4);
  CHECK((box.max() - Vector3d(0.25, 1.75, -48.75)).norm() < 1e-4);

  // Turned to the east, scaled by two and half sunk in, as one.
  tables[0].heading_rad = std::numbers::pi / 2.0;
  tables[0].scale = 2.0;
  tables[0].burial = 0.5;
  tables[0].part_classes = true;
  placed = place_objects(tables, 1, bed);
  const PlacedObjects::One& turned = placed.objects.front();
  CHECK((turned.record.size_m - Vector3d(8.0, 4.0, 2.5)).norm() < 1e-4);
  CHECK(turned.record.buried == Approx(0.5).margin(2e-3));
  CHECK(turned.parts[1].class_name == "crate");
  box.setEmpty();
  for (std::size_t f = 0; f < turned.face_part.size(); ++f)
    if (turned.face_part[f] == 1)
      for (const std::uint32_t v : turned.mesh.faces[f])
        box.extend(turned.mesh.positions[v].cast<double>().eval());
  CHECK((box.center().head<2>() - Eigen::Vector2d(3.0, 0.0)).norm() < 1e-4);

  // Copies of the whole, at random places.
  const std::size_t faces = turned.mesh.faces.size();
  tables[0].count = 3;
  placed = place_objects(tables, 1, bed);
  REQUIRE(placed.objects.size() == 4);
  CHECK(placed.objects[2].mesh.faces.size() == faces);
}
