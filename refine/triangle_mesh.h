#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/refine/error.h>

namespace ensonify::refine {

/// A fault in a mesh or grid from a file. The message names the file and place, the fault, the
/// remedy.
struct MeshError : Error {
  using Error::Error;
};

using Face = std::array<std::uint32_t, 3>;  ///< three vertices, counter-clockwise seen from outside

/// For a large mesh: faces, and half as many vertices.
inline constexpr double mesh_bytes_per_face = sizeof(Face) + 0.5 * sizeof(Eigen::Vector3f);

/// A view of triangles, in local metres.
struct Triangles {
  std::span<const Eigen::Vector3f> positions;
  std::span<const Face> faces;
  std::span<const std::uint32_t> numbers = {};  ///< each face's number; empty: 0, 1, 2 ...

  std::uint32_t number(std::uint32_t face) const { return numbers.empty() ? face : numbers[face]; }

  Eigen::Vector3d corner(std::uint32_t face, int k) const {
    return positions[faces[face][static_cast<std::size_t>(k)]].cast<double>();
  }
};

/// Indexed triangles. Positions are float metres relative to world_origin, which is double (so UTM
/// eastings and centimetre cells work together): world = world_origin + position.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Face> faces;
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();

  operator Triangles() const { return {positions, faces, {}}; }
};

/// Adds all vertices and faces of another mesh; its world origin does not count.
void append(TriangleMesh& mesh, Triangles more);

/// The box around the vertices that faces use, local metres; both corners are zero without faces.
struct Bounds {
  Eigen::Vector3f lowest = Eigen::Vector3f::Zero();
  Eigen::Vector3f highest = Eigen::Vector3f::Zero();

  Eigen::Vector3d middle() const { return 0.5 * (lowest.cast<double>() + highest.cast<double>()); }
};
/// The vertices of all faces must be there.
Bounds bounds(Triangles triangles);

/// Whether faces enclose a volume, and show their outer sides: each edge, by the numbers of its
/// vertices, has two faces in opposite directions, and each connected body's volume is positive and
/// more than rounding. The vertices of all faces must be there.
bool encloses_volume(Triangles triangles);

/// What `mesh-info` reports. For edges, vertices at one place count as one vertex.
struct MeshSummary {
  std::size_t vertices = 0;
  std::size_t faces = 0;
  Eigen::Vector3d lowest = Eigen::Vector3d::Zero();   ///< world metres
  Eigen::Vector3d highest = Eigen::Vector3d::Zero();  ///< world metres
  std::size_t boundary_edges = 0;                     ///< used by one face
  std::size_t non_manifold_edges = 0;                 ///< used by three or more
};
/// The same of a mesh whose faces' vertices are all there. Throws std::bad_alloc.
MeshSummary summarise(const TriangleMesh& mesh);

}  // namespace ensonify::refine
