#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/trace/ray.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// Finds nearest hits over the triangles it was given. Queries are const and may run on any number
/// of threads at once.
///
/// The contract, the same for every back-end (tests/contract): both sides of a face are hit; a hit
/// has t_min <= t <= t_max; a degenerate face is never hit; an empty mesh is missed. Non-finite or
/// huge (above 1e18) rays, zero directions and negative t_min throw std::invalid_argument.
class Intersector {
 public:
  virtual ~Intersector() = default;

  /// What its last bits depend on, beside its libraries: an instruction set, or "portable".
  virtual std::string_view code_path() const = 0;

  /// hits[fan.ray number], a miss for rays outside the beam. hits.size() == planes * elevations.
  virtual void intersect(const RayFan& fan, std::span<Hit> hits) const = 0;
  /// hits[i] belongs to rays[i].
  virtual void intersect(std::span<const Ray> rays, std::span<Hit> hits) const = 0;
};

/// A back-end: its name, one line of help, and how to make one over triangles, which must outlive it.
/// Making one throws refine::MeshError for a vertex that is not finite or beyond 1e18.
struct IntersectorKind {
  std::string_view name;
  std::string_view help;
  std::unique_ptr<Intersector> (*make)(refine::Triangles triangles);
};
std::span<const IntersectorKind> intersector_kinds();

/// The back-end of that name. Throws std::invalid_argument, listing the names there are.
std::unique_ptr<Intersector> make_intersector(std::string_view name, refine::Triangles triangles);

/// The guards of the contract, for back-ends to call.
void check_ray(const Ray& ray);
void check_fan(const RayFan& fan, std::span<const Hit> hits);
void check_vertices(refine::Triangles triangles);

}  // namespace ensonify::engine
