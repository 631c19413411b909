#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <ensonify/refine/edge_collapse.h>

#include "support/catch.h"
#include "support/invariants.h"
#include "support/meshes.h"

using namespace ensonify::refine;
using ensonify::tests::broken_invariants;
using Lines = std::vector<std::string>;

namespace {

/// A partly refined grid whose hierarchy a test may replace by a wrong one.
struct Refined {
  ProgressiveMesh hierarchy =
      build_by_edge_collapse(ensonify::tests::open_grid(30, 30, 1.0, 0.5, 5));
  FanVolume volume = {.apex = {0.0, 0.0, 4.0},
                      .array_axis = {1.0, 0.0, 0.0},
                      .middle = {0.0, 0.0, -1.0},
                      .pole = {0.0, 1.0, 0.0},
                      .truncation_rad = 0.05,
                      .elevation_low_rad = -1.5,
                      .elevation_high_rad = 1.5,
                      .range_m = 10.0};
  ActiveMesh mesh{hierarchy};

  Refined() {
    mesh.refine({&volume, 1});
    REQUIRE(broken_invariants(hierarchy) == Lines{});
    REQUIRE(broken_invariants(mesh, {&volume, 1}) == Lines{});
  }
  Refined(const Refined&) = delete;

  /// Replaces the refined hierarchy by a changed one.
  void spoil(const std::function<void(ProgressiveMeshArrays&)>& change) {
    ProgressiveMeshArrays arrays = ensonify::tests::arrays_of(hierarchy);
    change(arrays);
    hierarchy = std::move(arrays);
  }

  /// An active inner vertex.
  const ActiveMesh::Node& inner() const {
    return *std::ranges::find_if(mesh.nodes(), [](const ActiveMesh::Node& node) {
      return node.is_active() && !node.is_leaf();
    });
  }
  /// The progressive mesh's index of an active face, exact or coarse.
  std::uint32_t slot(bool exact) const {
    return std::ranges::find_if(mesh.faces(),
                                [&](const ActiveMesh::ActiveFace& face) {
                                  return face.slot != ProgressiveMesh::none &&
                                         exact == std::ranges::all_of(
                                                      face.vertices, [&](std::uint32_t v) {
                                                        return mesh.nodes()[v].is_leaf();
                                                      });
                                })
        ->slot;
  }
  bool says(const std::string& law) const {
    const Lines lines = broken_invariants(mesh, {&volume, 1});
    return std::ranges::any_of(lines,
                               [&](const std::string& line) { return line.starts_with(law); });
  }
};

}  // namespace

TEST_CASE("a face of a vertex outside its node's sphere is noticed") {
  Refined r;
  r.spoil([](auto& mesh) {
    for (Sphere& sphere : mesh.spheres) sphere.radius *= 0.98f;
  });
  CHECK(broken_invariants(r.hierarchy).size() == 1);
}

TEST_CASE("a touched vertex that was not split is noticed") {
  Refined r;
  r.spoil([&](auto& mesh) { mesh.spheres[r.inner().number].radius = 1e3f; });
  CHECK(r.says("no active inner sphere meets a volume"));
}

TEST_CASE("faces that are missing from the exact ones are noticed") {
  Refined r;
  // After a reset their nodes are not split; the footprint still has them.
  r.mesh.reset();
  CHECK(r.says("the exact faces contain the footprint's"));
}

TEST_CASE("leaves, children and faces that are not the hierarchy's are noticed") {
  SECTION("a child's range") {
    Refined r;
    const auto split = std::ranges::find_if(r.mesh.nodes(), [](const ActiveMesh::Node& node) {
      return node.left != ProgressiveMesh::none;
    });
    r.spoil([&](auto& mesh) { ++mesh.mid[split->number]; });
    CHECK(r.says("children are the hierarchy's"));
  }
  SECTION("a leaf without an ancestor") {
    Refined r;
    r.spoil([](auto& mesh) { mesh.points.emplace_back(); });
    CHECK(r.says("a leaf has an active ancestor"));
    CHECK(broken_invariants(r.mesh, {&r.volume, 1}).front().ends_with(", 1 in all"));
  }
  SECTION("the order of a face's corners") {
    Refined r;
    r.spoil([&](auto& mesh) {
      Face& face = mesh.faces[r.slot(true)];
      std::rotate(face.begin(), face.begin() + 1, face.end());
    });
    CHECK(r.says("a face joins its corners' active ancestors"));
  }
  SECTION("a face that should be active") {
    Refined r;
    r.spoil([&](auto& mesh) {
      mesh.faces.push_back(mesh.faces[r.slot(true)]);
      mesh.source_face.push_back(0);
    });
    CHECK(r.says("active are the original faces with three active ancestors"));
  }
  SECTION("a face's number in the source") {
    Refined r;
    r.spoil([&](auto& mesh) {
      std::swap(mesh.source_face[r.slot(true)], mesh.source_face[r.slot(false)]);
    });
    CHECK(r.says("exact are"));
  }
}

TEST_CASE("a split that would force an earlier one is noticed") {
  Refined r;
  // With all orders reversed, every node that a split forces was collapsed too early.
  r.spoil([](auto& mesh) {
    for (std::uint32_t& order : mesh.order)
      order = static_cast<std::uint32_t>(mesh.order.size()) - order;
  });
  CHECK(r.says("what a split would force was collapsed later"));
}
