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
  double east_m = 0.0, north_m = 0.0;  ///< its middle, local metres
  double heading_rad = 0.0;
  double scale = 1.0;  ///< metres per unit of the mesh
};

/// An object on the bed.
struct SetDown {
  ObjectMesh mesh;
  /// Share of its height under the bed's plane, as high as at its middle unless the object follows
  /// the slope.
  double buried = 0.0;
};

/// The rotation of a mesh by an object's roll, pitch and heading.
Eigen::Matrix3d attitude(const ObjectOptions& object, double heading_rad);

/// A mesh turned to the object's attitude about the middle of its bounding box, scaled, and set
/// down on a bed. If it follows the slope, it is tilted with the plane that fits the bed's heights
/// below its bounding box best in least squares. It is lowered until one of its vertices meets the
/// bed or a vertex of the bed meets it, then raised or sunk by the object's height or burial, and
/// sunk by `sunk_m`, in the mesh's units. A burial is the share of the way from there to the height
/// at which the bed covers all of it; on a level bed that is a share of its height. `what` begins
/// messages. Throws refine::MeshError for a place without a bed below it.
SetDown set_down(const refine::TriangleMesh& mesh, const ObjectOptions& object, const Spot& spot,
                 const BedGrid& bed, const std::string& what, double sunk_m = 0.0);

/// A pipeline, cable, rope or chain laid over a bed along the object's path (laid_line.h), which is
/// turned and scaled about the spot, as thick as its sizes times the scale. `burial` is the stream
/// of the changes of its burial. Throws as set_down, and for a path that is too short for a chain's
/// link.
SetDown lay_down(const ObjectOptions& object, const Spot& spot, const BedGrid& bed,
                 const std::string& what, const RandomStream& burial);

}  // namespace ensonify::engine
