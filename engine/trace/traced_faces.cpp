#include <ensonify/engine/trace/traced_faces.h>

#include <utility>

#include <ensonify/engine/trace/face_source.h>
#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {

const Faces& all_faces(TracedFaces& faces) {
  if (const auto* bed = std::get_if<BedAndObjects>(&faces)) faces = bed->source->prepare(bed->fans);
  return std::get<Faces>(faces);
}

bool list_runs(TracedFaces& faces, const RayFan& fan, std::size_t number, FanRuns& runs) {
  auto* const found = std::get_if<FoundRuns>(&faces);
  if (!found) return all_faces(faces).intersector->list_runs(fan, runs);
  std::swap(runs, found->of_fans[number]);
  return true;
}

const refine::Triangles& triangles_of(const TracedFaces& faces) {
  if (const auto* found = std::get_if<FoundRuns>(&faces)) return found->triangles;
  return std::get<Faces>(faces).triangles;
}

}  // namespace ensonify::engine
