#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// An object's faces in its own frame, turned and scaled as it lies, and where that frame is. What
/// is derived from faces (normals, flat parts, curvatures) comes from here, not from the seafloor's
/// mesh: floats are 0.06 mm apart 1 km from the middle of the seabed, and 3 cm at 500 km.
struct ObjectMesh {
  std::vector<Eigen::Vector3d> positions;  ///< metres, from `place`
  std::vector<refine::Face> faces;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< local metres
  double rounding_m = 0.0;  ///< of the numbers that the positions come from: standard deviation

  ObjectMesh() = default;
  /// That of a mesh; its world origin does not count.
  ObjectMesh(const refine::TriangleMesh& mesh);

  const Eigen::Vector3d& corner(std::uint32_t face, int k) const {
    return positions[faces[face][static_cast<std::size_t>(k)]];
  }
  /// Around the vertices that faces use, from `place`; all zero without faces.
  Eigen::AlignedBox3d box() const;
  /// The mesh in local metres, as rays see it.
  refine::TriangleMesh in_floats() const;
};

/// The meshes as bytes, in the byte order of the machine, and the reverse, which throws
/// std::out_of_range for bytes that are not these.
std::string bytes_of(const std::vector<ObjectMesh>& meshes);
std::vector<ObjectMesh> object_meshes_of(std::string_view bytes);

}  // namespace ensonify::engine
