#pragma once

#include <string>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// An object that a session adds to a scene and moves: a vehicle, a buoy on its line, a diver.
struct MovingObject {
  /// In metres, with z up and y along the object's heading; a pose places the origin of this frame.
  /// If the mesh encloses a volume, perhaps after a repair (refine::encloses_volume,
  /// refine::repair), the outer sides of its faces scatter; otherwise both sides do. The mesh's
  /// world_origin is ignored.
  refine::TriangleMesh mesh;
  /// A material of the scene, or a name that material.h defines.
  std::string material = "fouled steel";
  std::string class_name = "object";
};

}  // namespace ensonify::engine
