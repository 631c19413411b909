#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// An object's faces in the object's own frame, turned and scaled as the object lies, and the place
/// of this frame. Values that are derived from faces (normals, flat parts, curvatures) come from
/// these doubles and not from the floats of the seafloor's mesh: neighbouring floats differ by
/// 0.06 mm at 1 km from the middle of the seabed, and by 3 cm at 500 km.
struct ObjectMesh {
  std::vector<Eigen::Vector3d> positions;  ///< metres, relative to `place`
  std::vector<refine::Face> faces;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< local metres
  double rounding_m = 0.0;  ///< standard deviation of the rounding of `positions`

  ObjectMesh() = default;
  /// Has the mesh's positions and faces. The mesh's world origin is ignored.
  ObjectMesh(const refine::TriangleMesh& mesh);

  const Eigen::Vector3d& corner(std::uint32_t face, int k) const {
    return positions[faces[face][static_cast<std::size_t>(k)]];
  }
  /// The box around the vertices that faces use, relative to `place`; all zero without faces.
  Eigen::AlignedBox3d box() const;
  /// The mesh in local metres, as rays see it.
  refine::TriangleMesh in_floats() const;
};

/// The meshes as bytes, in the byte order of the machine.
std::string bytes_of(const std::vector<ObjectMesh>& meshes);
/// The inverse of bytes_of(). Throws std::out_of_range for bytes that bytes_of() did not make.
std::vector<ObjectMesh> object_meshes_of(std::string_view bytes);

}  // namespace ensonify::engine
