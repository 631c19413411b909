#pragma once

#include <string>

#include <Eigen/Core>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/seafloor/bed_height.h>
#include <ensonify/engine/seafloor/object_mesh.h>
#include <ensonify/engine/seafloor/objects/object_options.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// The place, heading and scale of one object of a table.
struct Spot {
  double east_m = 0.0, north_m = 0.0;  ///< middle of the object, local metres
  double heading_rad = 0.0;
  double scale = 1.0;  ///< metres per unit of the mesh
};

/// An object on the bed.
struct SetDown {
  ObjectMesh mesh;
  /// Share of the object's height under the plane that fits the bed below it. If the object does
  /// not follow the slope, the plane is level.
  double buried = 0.0;
};

/// The rotation of a mesh by an object's roll, pitch and heading.
Eigen::Matrix3d attitude(const ObjectOptions& object, double heading_rad);

/// Sets a mesh down on a bed. The mesh is turned to the object's attitude about the middle of its
/// bounding box and scaled. If the object follows the slope, it is tilted with the plane that fits
/// the bed's heights below its bounding box in least squares. It is lowered until one of its
/// vertices touches the bed or a vertex of the bed touches it. Then it is raised or sunk by the
/// object's height or burial, and sunk by `sunk_m`, in the mesh's units. A burial is the share of
/// the way from touching the bed to being covered by the bed; on a level bed this is a share of the
/// object's height. `what` begins messages. Throws refine::MeshError for a place without a bed.
SetDown set_down(const refine::TriangleMesh& mesh, const ObjectOptions& object, const Spot& spot,
                 const BedGrid& bed, const std::string& what, double sunk_m = 0.0);

/// Lays a pipeline, cable, rope or chain over a bed along the object's path (laid_line.h). The path
/// is turned and scaled about the spot, and the sizes are scaled too. `burial` is the random stream
/// for changes of the burial. Throws refine::MeshError for a place without a bed below it, for a
/// path that makes too many pieces, and for a path that is too short for a chain's link.
SetDown lay_down(const ObjectOptions& object, const Spot& spot, const BedGrid& bed,
                 const std::string& what, const RandomStream& burial);

}  // namespace ensonify::engine
