#include <ensonify/refine/mesh_repair.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include <ensonify/refine/mesh_reader.h>

#include "support/catch.h"
#include "support/data.h"
#include "support/manifold.h"

using namespace ensonify::refine;
using ensonify::tests::manifold_fault;

namespace {

/// Counts edges with one face, by vertex number: two vertices at one place are different.
std::size_t borders(const TriangleMesh& mesh) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> directed;
  for (const Face& face : mesh.faces)
    for (std::size_t k = 0; k < 3; ++k) directed.insert({face[k], face[(k + 1) % 3]});
  return static_cast<std::size_t>(std::ranges::count_if(directed, [&](const auto& edge) {
    return !directed.contains({edge.second, edge.first});
  }));
}

bool equal(const TriangleMesh& a, const TriangleMesh& b) {
  const auto same_bytes = [](const auto& x, const auto& y) {
    return x.size() == y.size() &&
           (x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof(x[0])) == 0);
  };
  return same_bytes(a.positions, b.positions) && same_bytes(a.faces, b.faces) &&
         a.world_origin == b.world_origin;
}

/// Six times the signed volume.
double volume(const TriangleMesh& mesh) {
  double sum = 0.0;
  for (const Face& face : mesh.faces)
    sum += mesh.positions[face[0]].cast<double>().dot(
        mesh.positions[face[1]].cast<double>().cross(mesh.positions[face[2]].cast<double>()));
  return sum;
}

/// Repairs, and checks everything that is promised for any mesh.
RepairedMesh checked_repair(const TriangleMesh& mesh, double weld_tolerance_m = 0.0) {
  RepairedMesh repaired = repair(mesh, weld_tolerance_m);
  const RepairReport& report = repaired.report;
  const std::string fault = manifold_fault(repaired.mesh);
  CAPTURE(fault);
  CHECK(fault.empty());
  CHECK(repaired.mesh.world_origin == mesh.world_origin);

  // Kept faces have the same places and order; only counted faces are dropped.
  REQUIRE(repaired.source_face.size() == repaired.mesh.faces.size());
  CHECK(std::ranges::is_sorted(repaired.source_face));
  CHECK(std::ranges::adjacent_find(repaired.source_face) == repaired.source_face.end());
  CHECK(repaired.mesh.faces.size() + report.degenerate_faces + report.duplicate_faces ==
        mesh.faces.size());
  const double reach = 1.0001 * std::max(weld_tolerance_m, 0.0);
  std::size_t astray = 0, turned = 0;
  for (std::size_t f = 0; f < repaired.mesh.faces.size(); ++f) {
    const Face& now = repaired.mesh.faces[f];
    const Face& before = mesh.faces[repaired.source_face[f]];
    const auto near = [&](std::size_t k, std::size_t was) {
      return (repaired.mesh.positions[now[k]] - mesh.positions[before[was]]).norm() <= reach;
    };
    const bool straight = near(1, 1) && near(2, 2), swapped = near(1, 2) && near(2, 1);
    astray += !near(0, 0) || !(straight || swapped);
    turned += !straight;
  }
  CHECK(astray == 0);
  if (weld_tolerance_m <= 0.0) {  // otherwise corners can be near each other
    CHECK(turned == report.flipped_faces);
    CHECK(repaired.mesh.positions.size() + report.welded_vertices + report.unreferenced_vertices ==
          mesh.positions.size() + report.split_vertices);
  }

  // A second repair changes nothing.
  for (const double again_m : {weld_tolerance_m, -1.0}) {
    const RepairedMesh again = repair(repaired.mesh, again_m);
    CHECK(again.report.total() == 0);
    CHECK(equal(again.mesh, repaired.mesh));
  }
  // Only counted changes were made.
  if (report.total() == 0) CHECK(equal(repaired.mesh, mesh));
  return repaired;
}

RepairReport counts(const TriangleMesh& mesh, double weld_tolerance_m = 0.0) {
  return checked_repair(mesh, weld_tolerance_m).report;
}

/// A report's counts that are not zero, in one line.
std::string text(const RepairReport& r) {
  std::string out;
  const auto add = [&](const char* name, std::size_t count) {
    if (count > 0) out += std::to_string(count) + " " + name + " ";
  };
  add("welded", r.welded_vertices);
  add("degenerate", r.degenerate_faces);
  add("duplicate", r.duplicate_faces);
  add("non-manifold", r.non_manifold_edges);
  add("unorientable", r.unorientable_edges);
  add("split", r.split_vertices);
  add("flipped", r.flipped_faces);
  add("unreferenced", r.unreferenced_vertices);
  return out.empty() ? "in order" : out;
}

TriangleMesh tetrahedron(const Eigen::Vector3f& at = Eigen::Vector3f::Zero()) {
  TriangleMesh mesh;
  for (const Eigen::Vector3f& p : {Eigen::Vector3f(0, 0, 0), Eigen::Vector3f(1, 0, 0),
                                   Eigen::Vector3f(0, 1, 0), Eigen::Vector3f(0, 0, 1)})
    mesh.positions.emplace_back(at + p);
  mesh.faces = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  return mesh;
}

/// A grid of quads, two triangles each, with its last columns or rows optionally joined to the
/// first; `twisted` joins the last column to the first upside down.
TriangleMesh sheet(std::uint32_t columns, std::uint32_t rows, bool round_columns = false,
                   bool round_rows = false, bool twisted = false) {
  TriangleMesh mesh;
  const std::uint32_t across = columns + !round_columns, up = rows + !round_rows;
  for (std::uint32_t row = 0; row < up; ++row)
    for (std::uint32_t column = 0; column < across; ++column) {
      // Slightly curved, so that no three vertices are on a line.
      const double x = column, y = row;
      mesh.positions.emplace_back(float(x + 0.01 * y * y), float(y + 0.013 * x * x),
                                  float(std::sin(1.7 * x) + std::cos(2.3 * y)));
    }
  const auto vertex = [&](std::uint32_t column, std::uint32_t row) {
    if (round_rows) row %= rows;
    if (round_columns && column == columns) {
      column = 0;
      if (twisted) row = round_rows ? (rows - row) % rows : rows - row;
    }
    return row * across + column;
  };
  for (std::uint32_t row = 0; row < rows; ++row)
    for (std::uint32_t column = 0; column < columns; ++column) {
      const std::uint32_t a = vertex(column, row), b = vertex(column + 1, row),
                          c = vertex(column + 1, row + 1), d = vertex(column, row + 1);
      mesh.faces.push_back({a, b, c});
      mesh.faces.push_back({a, c, d});
    }
  return mesh;
}

/// A sphere of `rings` x `columns` around a place, oriented outwards.
TriangleMesh sphere(double radius_m, Eigen::Vector3d at = Eigen::Vector3d::Zero(),
                    std::uint32_t columns = 12, std::uint32_t rings = 7, double flat = 1.0) {
  TriangleMesh mesh;
  const auto add = [&](double x, double y, double z) {
    mesh.positions.emplace_back((at + radius_m * Eigen::Vector3d(x, y, flat * z)).cast<float>());
  };
  add(0, 0, -1);
  for (std::uint32_t ring = 1; ring <= rings; ++ring)
    for (std::uint32_t column = 0; column < columns; ++column) {
      const double e = std::numbers::pi * (ring / (rings + 1.0) - 0.5);
      const double a = 2 * std::numbers::pi * column / columns;
      add(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
    }
  add(0, 0, 1);
  const auto vertex = [&](std::uint32_t ring, std::uint32_t column) {
    return 1 + (ring - 1) * columns + column % columns;
  };
  const auto top = static_cast<std::uint32_t>(mesh.positions.size() - 1);
  for (std::uint32_t column = 0; column < columns; ++column) {
    mesh.faces.push_back({0, vertex(1, column + 1), vertex(1, column)});
    for (std::uint32_t ring = 1; ring < rings; ++ring) {
      const std::uint32_t a = vertex(ring, column), b = vertex(ring, column + 1),
                          c = vertex(ring + 1, column + 1), d = vertex(ring + 1, column);
      mesh.faces.push_back({a, b, c});
      mesh.faces.push_back({a, c, d});
    }
    mesh.faces.push_back({vertex(rings, column), vertex(rings, column + 1), top});
  }
  return mesh;
}

void append(TriangleMesh& mesh, const TriangleMesh& other) {
  const auto shift = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
  for (const Face& face : other.faces)
    mesh.faces.push_back({face[0] + shift, face[1] + shift, face[2] + shift});
}

void turn(TriangleMesh& mesh) {
  for (Face& face : mesh.faces) std::swap(face[1], face[2]);
}

/// Every corner is a separate vertex, as in an STL.
TriangleMesh apart(const TriangleMesh& mesh) {
  TriangleMesh soup;
  soup.world_origin = mesh.world_origin;
  for (const Face& face : mesh.faces) {
    const auto first = static_cast<std::uint32_t>(soup.positions.size());
    for (const std::uint32_t vertex : face) soup.positions.push_back(mesh.positions[vertex]);
    soup.faces.push_back({first, first + 1, first + 2});
  }
  return soup;
}

/// `blades` triangles around one edge, like a paddle wheel; every second one reversed.
TriangleMesh paddle_wheel(int blades) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {0, 0, 1}};
  for (int blade = 0; blade < blades; ++blade) {
    const double angle = 2 * std::numbers::pi * blade / blades;
    mesh.positions.emplace_back(float(std::cos(angle)), float(std::sin(angle)), 0.5f);
    const auto tip = static_cast<std::uint32_t>(2 + blade);
    mesh.faces.push_back(blade % 2 ? Face{1, 0, tip} : Face{0, 1, tip});
  }
  return mesh;
}

}  // namespace

TEST_CASE("A mesh without faults comes back unchanged to the byte, and nothing is reported") {
  for (TriangleMesh mesh :
       {TriangleMesh{}, tetrahedron(), sheet(5, 4), sheet(9, 3, true), sheet(7, 5, true, true),
        sphere(2.0), sphere(1.0, {300.0, -200.0, 50.0})}) {
    mesh.world_origin = {500123.0, 6234000.0, -12.0};
    if (volume(mesh) < 0.0) turn(mesh);
    for (const double weld_tolerance_m : {-1.0, 0.0, 1e-4}) {
      CHECK(equal(repair(mesh, weld_tolerance_m).mesh, mesh));
      CHECK(text(counts(mesh, weld_tolerance_m)) == "in order");
    }
  }
}

TEST_CASE("A negative zero stays negative") {
  TriangleMesh mesh = tetrahedron();
  mesh.positions[0].x() = -0.0f;
  CHECK(equal(repair(mesh).mesh, mesh));
}

TEST_CASE("Vertices at one place become one, and bodies that only touch stay unchanged") {
  CHECK(text(counts(apart(tetrahedron()))) == "8 welded ");
  CHECK(text(counts(apart(tetrahedron()), -1.0)) == "in order");
  CHECK(borders(repair(apart(sphere(1.0))).mesh) == 0);

  TriangleMesh seam = sheet(1, 1);  // two triangles, each with its own diagonal
  seam.positions.push_back(seam.positions[0]);
  seam.positions.push_back(seam.positions[3]);
  seam.faces[1] = {4, 5, 2};
  const RepairedMesh sewn = checked_repair(seam);
  CHECK(text(sewn.report) == "2 welded ");
  CHECK(borders(sewn.mesh) == 4);

  TriangleMesh corner = tetrahedron();  // touches another at a corner
  append(corner, tetrahedron({1, 0, 0}));
  CHECK(text(counts(corner)) == "in order");
  TriangleMesh edge = tetrahedron();  // touches another along an edge: four faces
  TriangleMesh mirrored = tetrahedron();
  for (Eigen::Vector3f& p : mirrored.positions) p = {-p.x(), -p.y(), p.z()};
  append(edge, mirrored);
  CHECK(text(counts(edge)) == "in order");
  // The same bodies sharing one corner or one edge.
  corner.faces[4] = {1, 6, 5};
  corner.faces[5] = {1, 5, 7};
  corner.faces[7] = {6, 1, 7};
  CHECK(text(counts(corner)) == "1 split 1 unreferenced ");
}

TEST_CASE("Welding joins what is within reach, and moves nothing farther") {
  TriangleMesh soup = apart(sphere(1.0));
  std::mt19937 random(1);
  std::uniform_real_distribution<float> jitter(-1e-4f, 1e-4f);
  for (Eigen::Vector3f& p : soup.positions) p += Eigen::Vector3f(jitter(random), jitter(random), 0);
  CHECK(borders(checked_repair(soup, 0.0).mesh) == soup.positions.size());
  const RepairedMesh welded = checked_repair(soup, 1e-3);
  CHECK(borders(welded.mesh) == 0);
  CHECK(welded.mesh.positions.size() == sphere(1.0).positions.size());
  CHECK(welded.report.welded_vertices == soup.positions.size() - welded.mesh.positions.size());

  // A chain of vertices 1 apart, tolerance 1: they join in pairs. Each is used by its own faces.
  TriangleMesh chain;
  for (std::uint32_t i = 0; i < 8; ++i) {
    chain.positions.emplace_back(float(i), 0.0f, 0.0f);
    chain.positions.emplace_back(float(i), 10.0f + float(i) * 3.0f, 5.0f);
    chain.positions.emplace_back(float(i), -10.0f - float(i) * 3.0f, 5.0f);
    chain.faces.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const RepairedMesh pairs = checked_repair(chain, 1.0);
  std::set<float> left;
  for (const Face& face : pairs.mesh.faces) left.insert(pairs.mesh.positions[face[0]].x());
  CHECK(left == std::set<float>{0, 2, 4, 6});
  CHECK(pairs.report.welded_vertices == 4);  // joined, or moved where fans separate them again
  CHECK(text(counts(chain, 0.999)) == "in order");

  // Compared with a test of all pairs, at places on cell borders, far away, and near zero.
  std::uniform_int_distribution<int> steps(-6, 6);
  for (const double reach : {0.25, 0.5, 0.7, 3.0})
    for (const float far : {0.0f, 1000.0f, -4096.0f}) {
      TriangleMesh mesh;
      for (std::uint32_t i = 0; i < 120; ++i) {
        mesh.positions.emplace_back(far + 0.25f * float(steps(random)),
                                    0.25f * float(steps(random)), 0.25f * float(steps(random)));
        mesh.positions.emplace_back(1e4f, float(10 * i), 0.0f);
        mesh.positions.emplace_back(1e4f, float(10 * i), 5.0f);
        mesh.faces.push_back({3 * i, 3 * i + 1, 3 * i + 2});
      }
      std::vector<Eigen::Vector3f> kept, expected;
      for (std::uint32_t i = 0; i < 120; ++i) {
        const Eigen::Vector3f p = mesh.positions[3 * i];
        const auto found = std::ranges::find_if(kept, [&](const Eigen::Vector3f& q) {
          return (p.cast<double>() - q.cast<double>()).norm() <= reach;
        });
        expected.push_back(found == kept.end() ? p : *found);
        if (found == kept.end()) kept.push_back(p);
      }
      const RepairedMesh repaired = checked_repair(mesh, reach);
      bool as_expected = repaired.mesh.faces.size() == expected.size();
      for (std::size_t i = 0; as_expected && i < expected.size(); ++i)
        as_expected = repaired.mesh.positions[repaired.mesh.faces[i][0]] == expected[i];
      CHECK(as_expected);
    }
}

TEST_CASE("Faces without area are dropped, needles with area are kept") {
  TriangleMesh mesh = sheet(2, 2);
  const std::size_t faces = mesh.faces.size();
  mesh.positions.emplace_back(5.0f, 5.0f, 5.0f);
  mesh.positions.emplace_back(6.0f, 6.0f, 6.0f);
  mesh.positions.emplace_back(9.0f, 9.0f, 9.0f);
  mesh.positions.push_back(mesh.positions[0]);
  mesh.faces.push_back({9, 10, 11});  // on a line
  mesh.faces.push_back({3, 3, 4});    // corners repeated
  mesh.faces.push_back({5, 5, 5});
  mesh.faces.push_back({0, 12, 1});  // repeated once welded
  const RepairedMesh repaired = checked_repair(mesh);
  CHECK(text(repaired.report) == "4 degenerate 4 unreferenced ");
  CHECK(repaired.mesh.faces.size() == faces);

  TriangleMesh needle;
  needle.positions = {{0, 0, 0}, {1000, 0, 0}, {500, 1e-20f, 0}};
  needle.faces = {{0, 1, 2}};
  CHECK(text(counts(needle)) == "in order");
  for (Eigen::Vector3f& p : needle.positions) p *= 1e-22f;
  CHECK(text(counts(needle)) == "in order");
  // Relative to the third corner two corners are equal, in any order of corners.
  needle.positions = {{0, 0, 0}, {0, 1e-30f, 0}, {1e10f, 1e10f, 0}};
  for (const Face& face : {Face{0, 1, 2}, Face{1, 2, 0}, Face{2, 0, 1}, Face{0, 2, 1}}) {
    needle.faces = {face};
    CHECK(text(counts(needle)) == "1 degenerate 3 unreferenced ");
  }
}

TEST_CASE("A duplicate face, in either orientation, is dropped once") {
  for (const Face& copy : {Face{0, 2, 1}, Face{2, 1, 0}, Face{0, 1, 2}, Face{1, 0, 2}}) {
    TriangleMesh mesh = tetrahedron();
    mesh.faces.push_back(copy);
    mesh.faces.insert(mesh.faces.begin() + 2, copy);
    const RepairedMesh repaired = checked_repair(mesh);
    CHECK(text(repaired.report) == "2 duplicate ");
    CHECK(repaired.source_face == std::vector<std::uint32_t>{0, 1, 3, 4});
  }
  TriangleMesh twice = apart(sphere(1.0));  // two coincident spheres, one inside out
  TriangleMesh inside_out = sphere(1.0);
  turn(inside_out);
  append(twice, inside_out);
  const RepairedMesh once = checked_repair(twice);
  CHECK(once.report.duplicate_faces == inside_out.faces.size());
  CHECK(once.mesh.faces.size() == inside_out.faces.size());
  CHECK(borders(once.mesh) == 0);
}

TEST_CASE("Flipped patches follow the majority, in a tie the first face") {
  TriangleMesh mesh = sheet(6, 5);
  std::mt19937 random(5);
  for (const std::size_t count : {1u, 7u, 29u}) {
    TriangleMesh patched = mesh;
    std::vector<std::size_t> order(mesh.faces.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::shuffle(order.begin(), order.end(), random);
    for (std::size_t i = 0; i < count; ++i)
      std::swap(patched.faces[order[i]][1], patched.faces[order[i]][2]);
    const RepairedMesh repaired = checked_repair(patched);
    CHECK(repaired.report.flipped_faces == count);
    CHECK(repaired.report.total() == count);
    CHECK(equal(repaired.mesh, mesh));
  }
  TriangleMesh tie = sheet(1, 1);
  std::swap(tie.faces[0][1], tie.faces[0][2]);
  const RepairedMesh turned = checked_repair(tie);
  CHECK(turned.mesh.faces[0] == tie.faces[0]);
  CHECK(text(turned.report) == "1 flipped ");
}

TEST_CASE("Each closed body is oriented outwards") {
  TriangleMesh inverted = sphere(3.0, {1e4, -2e4, 500.0});
  const TriangleMesh right = inverted;
  turn(inverted);
  CHECK(counts(inverted).flipped_faces == inverted.faces.size());
  CHECK(equal(repair(inverted).mesh, right));

  TriangleMesh nested = sphere(3.0);
  TriangleMesh inner = sphere(1.0);
  turn(inner);
  append(nested, inner);
  const RepairReport report = counts(nested);
  CHECK(report.flipped_faces == inner.faces.size());
  CHECK(report.total() == inner.faces.size());

  for (Face& face : inverted.faces)  // one face has the right orientation
    if (face == inverted.faces[17]) std::swap(face[1], face[2]);
  CHECK(counts(inverted).flipped_faces == inverted.faces.size() - 1);

  // Very flat bodies, a thousand kilometres away.
  for (TriangleMesh plate : {sphere(1000.0, Eigen::Vector3d::Zero(), 40, 21, 5e-8),
                             sphere(10.0, {1e6, 0.0, 0.0}, 20, 9, 5e-8)}) {
    CHECK(text(counts(plate)) == "in order");
    turn(plate);
    CHECK(counts(plate).flipped_faces == plate.faces.size());
  }
  // A sheet and its back have no outside, independent of rounding: the majority decides.
  constexpr std::uint32_t side = 10;  // of vertices
  TriangleMesh purse = sheet(side - 1, side - 1);
  for (Eigen::Vector3f& p : purse.positions)
    p = Eigen::AngleAxisf(0.7f, Eigen::Vector3f(1, 2, 3).normalized()) * p;
  const auto front = purse;
  const auto on_rim = [](std::uint32_t v) {
    return v % side == 0 || v % side == side - 1 || v < side || v >= side * (side - 1);
  };
  const auto behind = [&](std::uint32_t v) { return on_rim(v) ? v : v + side * side; };
  append(purse, front);  // its vertices; its faces again, joined at the rim
  purse.faces = front.faces;
  for (const Face& f : front.faces)
    if (std::ranges::all_of(f, on_rim))  // on the rim of both sheets
      std::erase(purse.faces, f);
    else
      purse.faces.push_back({behind(f[0]), behind(f[2]), behind(f[1])});
  for (int way = 0; way < 2; ++way) {
    const RepairedMesh repaired = checked_repair(purse, -1.0);
    CHECK(borders(repaired.mesh) == 0);
    CHECK(repaired.report.flipped_faces == 0);
    turn(purse);
  }
}

TEST_CASE(
    "Edges of three, four and five faces are cut, and faces that belong together stay together") {
  CHECK(text(counts(paddle_wheel(2))) == "in order");
  // No two blades share more than the edge: each becomes a separate body.
  CHECK(text(counts(paddle_wheel(3))) == "1 non-manifold 4 split ");
  CHECK(text(counts(paddle_wheel(4))) == "1 non-manifold 6 split ");
  CHECK(text(counts(paddle_wheel(5))) == "1 non-manifold 8 split ");
  const RepairedMesh wheel = checked_repair(paddle_wheel(1000));
  CHECK(wheel.report.split_vertices == 2 * 999);

  // A sphere with a fin: the sphere stays closed and oriented outwards.
  TriangleMesh finned = sphere(1.0);
  const Face face = finned.faces[3];
  finned.positions.emplace_back(5.0f, 5.0f, 5.0f);
  finned.faces.push_back(
      {face[0], face[1], static_cast<std::uint32_t>(finned.positions.size() - 1)});
  const RepairedMesh ball = checked_repair(finned);
  CHECK(text(ball.report) == "1 non-manifold 2 split ");
  CHECK(borders(ball.mesh) == 3);
  turn(finned);
  CHECK(counts(finned).flipped_faces == finned.faces.size() - 1);
  CHECK(counts(apart(finned)).non_manifold_edges == 1);

  // Two bodies that share an edge are separated there, and both are closed.
  TriangleMesh bodies = tetrahedron();
  bodies.positions.emplace_back(-1.0f, 0.0f, 0.0f);
  bodies.positions.emplace_back(0.0f, -1.0f, 0.0f);
  for (const Face& f : tetrahedron().faces) {
    constexpr std::array<std::uint32_t, 4> other = {0, 4, 5, 3};
    bodies.faces.push_back({other[f[0]], other[f[1]], other[f[2]]});
  }
  const RepairedMesh parted = checked_repair(bodies);
  CHECK(text(parted.report) == "1 non-manifold 2 split ");
  CHECK(borders(parted.mesh) == 0);
}

TEST_CASE("A vertex where fans meet becomes one vertex per fan") {
  TriangleMesh bow_tie;
  bow_tie.positions = {{0, 0, 0}, {1, 1, 0}, {1, -1, 0}, {-1, 1, 0}, {-1, -1, 0}};
  bow_tie.faces = {{0, 2, 1}, {0, 3, 4}};
  const RepairedMesh two = checked_repair(bow_tie);
  CHECK(text(two.report) == "1 split ");
  CHECK(two.mesh.faces == std::vector<Face>{{0, 2, 1}, {5, 3, 4}});

  TriangleMesh cones;  // two closed fans and an open one, tip to tip
  cones.positions = {{0, 0, 0}};
  for (const float side : {-1.0f, 1.0f}) {
    const auto first = static_cast<std::uint32_t>(cones.positions.size());
    for (std::uint32_t i = 0; i < 5; ++i) {
      cones.positions.emplace_back(std::cos(1.2566f * float(i)), std::sin(1.2566f * float(i)),
                                   side);
      cones.faces.push_back({0, first + i, first + (i + 1) % 5});
    }
  }
  append(cones, tetrahedron({9, 9, 9}));
  cones.faces.push_back({0, 11, 12});
  const RepairReport report = counts(cones);
  CHECK(report.split_vertices ==
        2 + 2);  // and the edge 11, 12 has three faces: it is split at both
  CHECK(report.non_manifold_edges == 1);
}

TEST_CASE("One-sided surfaces are cut where orientations contradict") {
  for (const std::uint32_t columns : {5u, 6u, 20u}) {
    const RepairedMesh band = checked_repair(sheet(columns, 1, true, false, true));
    CHECK(band.report.unorientable_edges == 1);
    CHECK(band.report.split_vertices == 2);
    CHECK(borders(band.mesh) == 2 * columns + 2);
  }
  // Wider: the cut crosses the band, and its rim and the cut's two sides form one border.
  const RepairedMesh wide = checked_repair(sheet(40, 6, true, false, true));
  CHECK(wide.report.unorientable_edges >= 6);
  CHECK(wide.report.unorientable_edges <= 24);
  CHECK(borders(wide.mesh) == 80 + 2 * wide.report.unorientable_edges);

  const RepairedMesh klein = checked_repair(sheet(12, 8, true, true, true));
  CHECK(klein.report.unorientable_edges > 0);
  CHECK(borders(klein.mesh) == 2 * klein.report.unorientable_edges);

  TriangleMesh projective;  // the projective plane in six vertices
  for (int i = 0; i < 6; ++i)
    projective.positions.emplace_back(float(i), float(i * i), float(i * i * i));
  projective.faces = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}, {0, 5, 1},
                      {1, 2, 4}, {2, 3, 5}, {3, 4, 1}, {4, 5, 2}, {5, 1, 3}};
  CHECK(checked_repair(projective).report.unorientable_edges > 0);

  CHECK(counts(apart(sheet(9, 1, true, false, true))).unorientable_edges == 1);
}

TEST_CASE("Vertices that no face uses are dropped, alone or all") {
  TriangleMesh mesh = tetrahedron();
  mesh.positions.insert(mesh.positions.begin() + 2, Eigen::Vector3f(7, 7, 7));
  mesh.positions.emplace_back(8.0f, 8.0f, 8.0f);
  for (Face& face : mesh.faces)
    for (std::uint32_t& vertex : face) vertex += vertex >= 2;
  const RepairedMesh repaired = checked_repair(mesh);
  CHECK(text(repaired.report) == "2 unreferenced ");
  CHECK(equal(repaired.mesh, tetrahedron()));
  mesh.faces = {{1, 1, 1}};
  CHECK(text(counts(mesh)) == "1 degenerate 6 unreferenced ");
}

TEST_CASE("Any triangles come out manifold, in place and with all changes counted") {
  std::mt19937 random(2024);
  const auto below = [&](std::size_t n) {
    return static_cast<std::uint32_t>(std::uniform_int_distribution<std::size_t>(0, n - 1)(random));
  };
  std::set<std::string> seen;
  for (int round = 0; round < 3000; ++round) {
    TriangleMesh mesh;
    const std::size_t vertices = 3 + below(round % 3 == 0 ? 6 : 14), faces = 1 + below(40);
    const std::uint32_t span = round % 2 ? 3 : 1000;  // few places, or nearly all distinct
    for (std::size_t i = 0; i < vertices; ++i)
      mesh.positions.emplace_back(float(below(span)) - 1.0f, float(below(span)),
                                  float(below(span)));
    for (std::size_t i = 0; i < faces; ++i)
      mesh.faces.push_back({below(vertices), below(vertices), below(vertices)});
    constexpr std::array<double, 5> reaches = {0.0, 0.0, -1.0, 1.0, 1.5};
    const RepairReport report = counts(mesh, reaches[below(reaches.size())]);
    if (report.welded_vertices) seen.insert("welded");
    if (report.degenerate_faces) seen.insert("degenerate");
    if (report.duplicate_faces) seen.insert("duplicate");
    if (report.non_manifold_edges) seen.insert("non-manifold");
    if (report.unorientable_edges) seen.insert("unorientable");
    if (report.split_vertices) seen.insert("split");
    if (report.flipped_faces) seen.insert("flipped");
    if (report.unreferenced_vertices) seen.insert("unreferenced");
  }
  CHECK(seen.size() == 8);
}

TEST_CASE("Real meshes come out without faults") {
  // Edges with one face, and with three or more, by place, with all faces: as other programs count.
  struct Edges {
    std::size_t single = 0, crowded = 0;
  };
  const auto edges = [](const TriangleMesh& mesh) {
    const std::vector<std::uint32_t> place = weld(mesh.positions, 0.0);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
    for (const Face& face : mesh.faces)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = place[face[k]], b = place[face[(k + 1) % 3]];
        if (a != b) ++uses[std::minmax(a, b)];
      }
    Edges found;
    for (const auto& [edge, count] : uses) {
      found.single += count == 1;
      found.crowded += count > 2;
    }
    return found;
  };
  struct Known {
    const char* file;
    Edges edges;
    const char* report;
  };
  for (const Known& known :
       {Known{"mesh_underwater/skytteren_wreck.ply",
              {320, 34},
              "4 welded 10 degenerate 26 non-manifold 52 split 166 flipped 2 unreferenced "},
        Known{"mesh_underwater/uxo_b.ply", {0, 0}, "1209 welded "},
        Known{"mesh_underwater/large_rock.stl", {0, 0}, "in order"},
        Known{"mesh_underwater/coral_mcap.ply", {195, 0}, "in order"},
        Known{"mesh_standard/spot.obj", {0, 0}, "in order"},
        Known{"mesh_nasty/manifold_openscad-nonmanifold-crash.obj",
              {0, 18},
              "1 degenerate 3 duplicate 16 non-manifold 28 split "}}) {
    const auto file = ensonify::tests::data_file(known.file);
    if (!file) {
      WARN(known.file << " is missing; skipped");
      continue;
    }
    CAPTURE(known.file);
    const TriangleMesh mesh = read_mesh(*file);
    CHECK(edges(mesh).single == known.edges.single);
    CHECK(edges(mesh).crowded == known.edges.crowded);
    CHECK(text(counts(mesh)) == known.report);
  }
}

TEST_CASE("Equal places far away become one with any tolerance") {
  for (const float from : {1e3f, 1e8f, 1e12f, 4.9e15f, 8e15f, 3e16f, 9e17f}) {
    float far = from;
    for (int i = 0; i < 50; ++i) {
      far = std::nextafter(far, 1e18f);
      for (const double weld_tolerance_m : {0.0, 0.5, 3.0}) {
        CAPTURE(far, weld_tolerance_m);
        REQUIRE(weld(std::vector<Eigen::Vector3f>{{1, -3, -far}, {-2, 3, far}, {1, -3, -far}},
                     weld_tolerance_m) == std::vector<std::uint32_t>{0, 1, 0});
      }
    }
  }
}

TEST_CASE("Invalid arguments are refused") {
  TriangleMesh mesh = tetrahedron();
  CHECK_THROWS_AS(repair(mesh, std::nan("")), std::invalid_argument);
  CHECK_THROWS_AS(repair(mesh, std::numeric_limits<double>::infinity()), std::invalid_argument);
  mesh.faces[2][1] = 4;
  CHECK_THROWS_AS(repair(mesh), std::invalid_argument);
}
