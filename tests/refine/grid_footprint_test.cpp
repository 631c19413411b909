#include <ensonify/refine/grid_footprint.h>

#include <cstdint>
#include <set>
#include <stdexcept>
#include <vector>

#include "support/catch.h"
#include "support/heights.h"
#include "support/meshes.h"
#include "support/touched_faces.h"

using namespace ensonify::refine;
using namespace ensonify::tests;

namespace {

/// The grid's faces, then the bodies'.
TriangleMesh together(const HeightGrid& grid, const TriangleMesh& bodies) {
  TriangleMesh all = grid.mesh();
  append(all, bodies);
  return all;
}

/// Small triangles about the grid's middle.
TriangleMesh scattered(Random& random, int count, double size_m) {
  TriangleMesh bodies;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d place = 0.4 * size_m * uniform(random) * direction(random);
    const auto first = static_cast<std::uint32_t>(bodies.positions.size());
    for (int k = 0; k < 3; ++k)
      bodies.positions.emplace_back((place + 0.5 * direction(random)).cast<float>());
    bodies.faces.push_back({first, first + 1, first + 2});
  }
  return bodies;
}

}  // namespace

TEST_CASE("a grid's footprint has every face that touches the volumes, as the source has it") {
  Random random(11);
  for (const double holes : {0.0, 0.15}) {
    const Heights heights = random_heights(170, 140, 0.5, 2.0, holes, 4);
    const HeightGrid grid = heights.grid();
    const TriangleMesh bodies = scattered(random, 300, 70.0);
    const BallTree tree(bodies);
    const TriangleMesh all = together(grid, bodies);
    GridFootprint footprint(grid, tree);
    std::size_t lost = 0, touched = 0, touched_bodies = 0, found = 0;
    for (int i = 0; i < 60; ++i) {
      // Every third query is of two volumes.
      std::vector<FanVolume> volumes = {random_volume(random, 70.0)};
      if (i % 3 == 0) volumes.push_back(random_volume(random, 70.0));
      const ExactFaces exact = footprint.query(volumes);
      REQUIRE(exact.faces.size() == exact.source_faces.size());
      std::set<std::uint32_t> numbers;
      for (std::size_t f = 0; f < exact.faces.size(); ++f) {
        REQUIRE(numbers.insert(exact.source_faces[f]).second);
        const Face& source = all.faces[exact.source_faces[f]];
        for (std::size_t k = 0; k < 3; ++k)
          REQUIRE(exact.points[exact.faces[f][k]] == all.positions[source[k]]);
      }
      for (const FanVolume& volume : volumes)
        for (const std::uint32_t face : touched_faces(all, volume, random)) {
          lost += !numbers.contains(face);
          touched_bodies += face >= grid.faces();
          ++touched;
        }
      found += exact.faces.size();
    }
    CHECK(lost == 0);
    CHECK(touched > 5000);
    CHECK(touched_bodies > 50);
    CHECK(found < 60 * all.faces.size() / 4);  // not simply all
  }
}

TEST_CASE("a volume that holds everything finds every face of a grid, one beyond it none") {
  const Heights heights = random_heights(131, 66, 0.5, 1.0, 0.1, 9);
  const HeightGrid grid = heights.grid();
  const BallTree none(Triangles{});
  GridFootprint footprint(grid, none);
  FanVolume v{.apex = {0.0, -200.0, 0.0},
              .truncation_rad = 1.5,
              .elevation_low_rad = -1.5,
              .elevation_high_rad = 1.5,
              .range_m = 1000.0};
  CHECK(footprint.query({&v, 1}).faces.size() == grid.faces());
  v.apex.y() = 200.0;  // looks away
  CHECK(footprint.query({&v, 1}).faces.empty());
}

TEST_CASE("The growth of a tree over many triangles can be stopped at each of its large nodes") {
  Random random(5);
  const TriangleMesh bodies = scattered(random, 300'000, 1000.0);
  int left = 1000;
  const auto stop = [&] {
    if (--left == 0) throw std::runtime_error("stopped");
  };
  const BallTree tree(bodies, stop);
  // Nodes of 300,000, two halves and four quarters.
  CHECK(left == 1000 - 7);
  left = 4;
  CHECK_THROWS_WITH(BallTree(bodies, stop), "stopped");
}
