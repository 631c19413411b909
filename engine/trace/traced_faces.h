#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <variant>

#include <ensonify/engine/trace/fan_runs.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::refine {
class HeightGrid;
}

namespace ensonify::engine {

class FaceSource;
class Intersector;

/// Faces, and an intersector that was built over them.
struct Faces {
  const Intersector* intersector = nullptr;
  refine::Triangles triangles;  ///< Hit::index counts in them
  std::uint64_t version = 0;    ///< changes whenever the triangles do
};

/// The bed of some fans as a grid of heights, and the faces of the objects on it.
struct BedAndObjects {
  const refine::HeightGrid* bed = nullptr;
  Faces objects;                 ///< without an intersector if there are none
  FaceSource* source = nullptr;  ///< prepares all faces instead, see all_faces()
  std::span<const RayFan> fans;
};

/// The runs of some fans, where the face source has found them already.
struct FoundRuns {
  refine::Triangles triangles;  ///< which the runs index
  std::span<FanRuns> of_fans;   ///< in the order of the fans; a tracer may take them
};

/// What the fans of a ping are traced over.
using TracedFaces = std::variant<Faces, BedAndObjects, FoundRuns>;

/// Returns the faces. If `faces` has a bed and its objects, replaces them by all faces first.
const Faces& all_faces(TracedFaces& faces);

/// Gets the runs of a fan, the `number`th (from 0) of those that the faces were prepared for.
/// Returns false if the runs are not found already and the intersector does not list runs.
bool list_runs(TracedFaces& faces, const RayFan& fan, std::size_t number, FanRuns& runs);

/// The triangles that hits and runs index.
const refine::Triangles& triangles_of(const TracedFaces& faces);

}  // namespace ensonify::engine
