#include <ensonify/refine/mesh_clusters.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <ensonify/refine/height_tiles.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/heights.h"
#include "support/invariants.h"
#include "support/meshes.h"
#include "support/temporary_folder.h"
#include "support/touched_faces.h"

using namespace ensonify::refine;
using namespace ensonify::tests;

namespace {

namespace fs = std::filesystem;

constexpr double cell_m = 0.5;

/// Fans to both sides, a few metres over the bed, with the track to the north.
std::vector<FanVolume> fans_at(double x_m, double y_m) {
  std::vector<FanVolume> volumes;
  for (const double side : {-1.0, 1.0}) {
    const Eigen::Vector3d axis = Eigen::Vector3d::UnitY() * side;
    const Eigen::Vector3d middle = Eigen::Vector3d(side, 0.0, -0.5).normalized();
    volumes.push_back({.apex = {x_m, y_m, 6.0},
                       .array_axis = axis,
                       .middle = middle,
                       .pole = middle.cross(axis),
                       .truncation_rad = 0.02,
                       .elevation_low_rad = -0.6,
                       .elevation_high_rad = 0.4,
                       .range_m = 60.0});
  }
  return volumes;
}

/// Of 3 x 2 clusters, the last ones cut off.
struct Bed {
  explicit Bed(double holes)
      : heights(random_heights(600, 300, cell_m, 1.0, holes, 12)),
        grid(heights.grid()),
        bodies(ball(2, 1.0)),
        all(grid.mesh()) {
    for (Eigen::Vector3f& p : bodies.positions) p.z() += 1.5f;
    join(all, bodies, Eigen::Vector3f::Zero());
  }
  Heights heights;
  HeightGrid grid;
  TriangleMesh bodies, all;
  /// The borders between clusters.
  double border_x_m = (MeshClusters::cluster_cells - 0.5 * 599) * cell_m;
  double border_y_m = (MeshClusters::cluster_cells - 0.5 * 299) * cell_m;
};

/// Along a border, across a corner, inside, over the bodies, and beyond the bed.
std::vector<std::array<double, 2>> places(const Bed& bed) {
  std::vector<std::array<double, 2>> all;
  for (int i = 0; i < 5; ++i) {
    all.push_back({bed.border_x_m + 0.01 * i, -20.0 + 0.4 * i});
    all.push_back({bed.border_x_m - 1.0 + 0.4 * i, bed.border_y_m - 1.0 + 0.4 * i});
    all.push_back({100.0, -50.0 + 0.4 * i});
    all.push_back({-20.0 + 0.4 * i, 0.1 * i});
  }
  all.push_back({400.0, 0.0});
  return all;
}

/// The exact faces as their numbers and corners, in the order of the numbers.
using FacesByNumber = std::map<std::uint32_t, std::array<std::array<float, 3>, 3>>;
FacesByNumber faces_by_number(const ExactFaces& exact) {
  FacesByNumber faces;
  for (std::size_t f = 0; f < exact.faces.size(); ++f) {
    auto& corners = faces[exact.source_faces[f]];
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3f& p = exact.points[exact.faces[f][k]];
      corners[k] = {p.x(), p.y(), p.z()};
    }
  }
  // This is no assertion, because assertions of Catch2 are for one thread.
  if (faces.size() != exact.faces.size()) throw std::logic_error("two faces have one number");
  return faces;
}

std::vector<FacesByNumber> named_at(MeshClusters& clusters,
                                    const std::vector<std::array<double, 2>>& where) {
  ActiveClusters active(clusters);
  std::vector<FacesByNumber> all;
  for (const auto& [x_m, y_m] : where)
    all.push_back(faces_by_number(active.refine(fans_at(x_m, y_m))));
  return all;
}

}  // namespace

TEST_CASE("exact faces of clusters include every face that touches the volumes, over all borders") {
  const double holes = GENERATE(0.0, 0.1);
  const Bed bed(holes);
  MeshClusters clusters(bed.grid, bed.bodies, {}, "");
  CHECK(clusters.count() == 3 * 2 + 1);
  ActiveClusters active(clusters);
  Random random(5);
  std::size_t lost = 0, touched = 0, of_bodies = 0, at_borders = 0;
  for (const auto& [x_m, y_m] : places(bed)) {
    const std::vector<FanVolume> volumes = fans_at(x_m, y_m);
    const FacesByNumber faces = faces_by_number(active.refine(volumes));
    for (const auto& [number, corners] : faces)
      for (std::size_t k = 0; k < 3; ++k) {
        const Eigen::Vector3f& p = bed.all.positions[bed.all.faces[number][k]];
        REQUIRE(corners[k] == std::array{p.x(), p.y(), p.z()});
      }
    // Not simply all; the borders of holes stay too.
    CHECK(faces.size() < bed.all.faces.size() / (holes == 0.0 ? 10 : 6));
    for (const FanVolume& volume : volumes)
      for (const std::uint32_t face : touched_faces(bed.all, volume, random)) {
        lost += !faces.contains(face);
        ++touched;
        of_bodies += face >= bed.grid.faces();
        for (const std::uint32_t corner : bed.all.faces[face])
          at_borders += std::abs(bed.all.positions[corner].x() - bed.border_x_m) < 0.01 ||
                        std::abs(bed.all.positions[corner].y() - bed.border_y_m) < 0.01;
      }
  }
  CHECK(lost == 0);
  CHECK(touched > 5000);
  CHECK(of_bodies > 20);
  CHECK(at_borders > 100);
}

TEST_CASE("the active meshes of neighbouring clusters fit each other at any refinement") {
  const Bed bed(0.0);
  MeshClusters clusters(bed.grid, {}, {}, "");
  ActiveClusters active(clusters);
  for (const auto& [x_m, y_m] : {std::array{bed.border_x_m + 0.2, bed.border_y_m},
                                 std::array{bed.border_x_m + 0.6, bed.border_y_m + 0.4}}) {
    const std::vector<FanVolume> volumes = fans_at(x_m, y_m);
    active.refine(volumes);
    REQUIRE(active.active().size() >= 4);
    // Each edge at a cluster's border is also an edge of the neighbour, in the opposite direction.
    using Place = std::array<float, 3>;
    std::map<std::array<Place, 2>, int> open;
    for (const auto& its : active.active()) {
      CHECK(broken_invariants(its->mesh, volumes) == std::vector<std::string>{});
      const auto place = [&](std::uint32_t vertex) {
        const Eigen::Vector3f& p = its->mesh.position(vertex);
        return Place{p.x(), p.y(), p.z()};
      };
      for (const ActiveMesh::ActiveFace& face : its->mesh.faces()) {
        if (face.slot == ActiveMesh::none) continue;
        for (std::size_t k = 0; k < 3; ++k)
          if (face.opposites[k] == ActiveMesh::none)
            ++open[{place(face.vertices[k]), place(face.vertices[(k + 1) % 3])}];
      }
      CHECK(its->mesh.face_count() < its->progressive->source_face.size() / 4);
    }
    std::size_t met = 0, alone_inside = 0;
    for (const auto& [edge, count] : open) {
      CHECK(count == 1);
      if (open.contains({edge[1], edge[0]})) {
        ++met;
        continue;
      }
      // Inside the bed only the borders to clusters that are not in view are alone.
      for (const auto& [border, axis] : {std::pair{bed.border_x_m, 0u}, {bed.border_y_m, 1u}})
        alone_inside +=
            std::abs(edge[0][axis] - border) < 0.01 && std::abs(edge[1][axis] - border) < 0.01;
    }
    CHECK(met > 800);
    CHECK(alone_inside == 0);
  }
}

TEST_CASE("clusters in files have the faces of those in memory, whichever process made them") {
  const TemporaryFolder folder;
  const Bed bed(0.02);
  const auto where = places(bed);
  MeshClusters in_memory(bed.grid, bed.bodies, {}, "");
  const std::vector<FacesByNumber> expected = named_at(in_memory, where);
  const fs::path files = folder / "a.clusters";
  {
    // Two users work at once, in opposite directions.
    MeshClusters one(bed.grid, bed.bodies, files, "key"), other(bed.grid, bed.bodies, files, "key");
    std::vector<FacesByNumber> found, reversed;
    std::thread thread([&] { found = named_at(one, where); });
    const std::vector<std::array<double, 2>> back(where.rbegin(), where.rend());
    reversed = named_at(other, back);
    thread.join();
    CHECK(found == expected);
    CHECK(reversed.size() == expected.size());
  }
  {
    MeshClusters from_files(bed.grid, bed.bodies, files, "key");
    CHECK(named_at(from_files, where) == expected);
    CHECK(from_files.analysed() == 0);
  }
  SECTION("what is damaged, of another key or gone is made again") {
    std::vector<fs::path> all;
    for (const auto& entry : fs::directory_iterator(files)) all.push_back(entry.path());
    REQUIRE(all.size() >= 4);
    change_byte(all[0], fs::file_size(all[0]) / 2);
    fs::resize_file(all[1], 5000);
    fs::remove(all[2]);
    MeshClusters mended(bed.grid, bed.bodies, files, "key");
    CHECK(named_at(mended, where) == expected);
    CHECK(mended.analysed() == 3);
    MeshClusters of_other_key(bed.grid, bed.bodies, files, "another");
    CHECK(named_at(of_other_key, where) == expected);
    CHECK(of_other_key.analysed() == all.size());
  }
  SECTION("a folder that cannot be made leaves them in memory") {
    std::ofstream(folder / "file") << "no folder";
    MeshClusters nowhere(bed.grid, bed.bodies, folder / "file" / "a.clusters", "key");
    CHECK(named_at(nowhere, where) == expected);
  }
}

TEST_CASE("clusters of a grid in tiles make the tiles that they need, and no others") {
  const Heights heights = random_heights(2300, 700, cell_m, 1.0, 0.0, 13);
  const HeightGrid grid = heights.grid();
  const auto tiles = heights.tiles();
  const HeightGrid tiled(tiles);
  MeshClusters expected(grid, {}, {}, ""), found(tiled, {}, {}, "");
  const std::vector<std::array<double, 2>> where = {{-500.0, 0.0}, {-499.5, 0.5}, {-480.0, 100.0}};
  CHECK(named_at(found, where) == named_at(expected, where));
  CHECK(found.analysed() == expected.analysed());
  CHECK(found.analysed() < found.count() / 2);
  CHECK(tiles->tiles_made() < tiles->tiles());
}
