#pragma once

#include <string>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// What a session puts into a scene, and moves: a vehicle, a buoy on its line, a diver.
struct MovingObject {
  /// Metres, z up, y where its heading points, about the point that a pose places. The
  /// outer sides of its faces scatter if it encloses a volume, perhaps after a repair
  /// (refine::encloses_volume, refine::repair), else both sides. Its world_origin does not count.
  refine::TriangleMesh mesh;
  /// A material of the scene, or a name that material.h defines.
  std::string material = "fouled steel";
  std::string class_name = "object";
};

}  // namespace ensonify::engine
