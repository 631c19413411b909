#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/refine/error.h>

namespace ensonify::refine {

/// A fault in a mesh or grid from a file. The message has the file, the place, the fault, the
/// remedy.
struct MeshError : Error {
  using Error::Error;
};

using Face = std::array<std::uint32_t, 3>;  ///< three vertices, counter-clockwise seen from outside

/// Memory of a large mesh, which has half as many vertices as faces.
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

/// Adds all vertices and faces of another mesh. Their local positions stay the same.
void append(TriangleMesh& mesh, Triangles more);

/// A box in local metres. Both corners are zero for a mesh without faces.
struct Bounds {
  Eigen::Vector3f lowest = Eigen::Vector3f::Zero();
  Eigen::Vector3f highest = Eigen::Vector3f::Zero();

  Eigen::Vector3d middle() const { return 0.5 * (lowest.cast<double>() + highest.cast<double>()); }
};
/// The box around the vertices that faces use. All vertices of the faces must exist.
Bounds bounds(Triangles triangles);

/// Whether faces enclose a volume and are oriented outwards: each edge (a pair of vertex numbers)
/// has two faces in opposite directions, and the volume of each connected body is positive and more
/// than rounding. All vertices of the faces must exist.
bool encloses_volume(Triangles triangles);

/// Numbers that `mesh-info` reports. For edges, vertices at one place count as one vertex.
struct MeshSummary {
  std::size_t vertices = 0;
  std::size_t faces = 0;
  Eigen::Vector3d lowest = Eigen::Vector3d::Zero();   ///< world metres
  Eigen::Vector3d highest = Eigen::Vector3d::Zero();  ///< world metres
  std::size_t boundary_edges = 0;                     ///< edges of one face
  std::size_t non_manifold_edges = 0;                 ///< edges of three or more faces
};
/// Computes these numbers. All vertices of the mesh's faces must exist. Throws std::bad_alloc.
MeshSummary summarise(const TriangleMesh& mesh);

}  // namespace ensonify::refine
