#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/trace/fan_runs.h>
#include <ensonify/engine/trace/intersector_options.h>
#include <ensonify/engine/trace/ray.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// No component of a ray or a vertex may be larger. (Embree's own bound is a little wider.)
inline constexpr double largest_component = 1e18;

/// Finds nearest hits over the triangles it was given. Queries are const and may run on any number
/// of threads at once, but not while it is built.
///
/// The contract, the same for every back-end (tests/contract): both sides of a face are hit; a hit
/// has t_min <= t <= t_max; of several at one distance the face with the lowest number wins, and of
/// several with that number the first; a degenerate face is never hit; an empty mesh is missed;
/// hits call faces by the triangles' numbers, and tell their places among them. A hit depends on
/// the ray and on the faces that the ray meets: not on other faces, on the faces' order, or on how
/// vertices are numbered. (Embree's may in rare cases, see embree.h.) Non-finite or huge (above
/// 1e18) rays, zero directions and negative t_min throw std::invalid_argument.
class Intersector {
 public:
  virtual ~Intersector() = default;

  /// Takes these triangles, which must outlive the queries and not change, instead of those it had.
  /// Throws refine::MeshError for a face whose vertex is not there, not finite, or beyond what the
  /// back-end can hold (1e18 m, embree 1e9 m), std::bad_alloc or std::runtime_error where memory or
  /// a library refuses; it is empty then, and may be built again.
  virtual void build(refine::Triangles triangles) = 0;

  /// What its last bits depend on, beside its libraries: an instruction set ("avx2", or "avx2 fast"
  /// if not robust), or "portable".
  virtual std::string_view code_path() const = 0;

  /// hits[fan.ray number], a miss for rays outside the beam. hits.size() == planes * elevations.
  virtual void intersect(const RayFan& fan, std::span<Hit> hits) const = 0;
  /// The same run by run, where a back-end knows runs before it knows hits; false if it does not:
  /// they are to be taken from hits.
  virtual bool list_runs(const RayFan&, FanRuns&) const { return false; }
  /// hits[i] belongs to rays[i].
  virtual void intersect(std::span<const Ray> rays, std::span<Hit> hits) const = 0;
};

/// What an intersector computes with. It says how far off a sound answer may be.
enum class Precision {
  exact,      ///< the reference's own test: the same bits
  in_double,  ///< rounding of double, and of edges that pass within it
  in_float    ///< rounding of float about an origin near the mesh
};

/// A back-end: its name, one line of help, and how to make one, empty until it is built.
struct IntersectorKind {
  std::string_view name;
  std::string_view help;
  std::unique_ptr<Intersector> (*make)(const IntersectorOptions& options);
  bool takes_lists = true;  ///< of rays; else it answers fans alone
  Precision precision = Precision::in_float;
  /// Memory that a build over many faces takes at its peak, in addition to the mesh; at least.
  /// Measured over 2.4 million faces and rounded down; 0: not measured.
  double bytes_per_face = 0.0;
};
std::span<const IntersectorKind> intersector_kinds();

/// The kind of that name. Throws std::invalid_argument, listing the names there are.
const IntersectorKind& intersector_kind(std::string_view name);

/// The back-end of that name over triangles. Throws std::invalid_argument, listing the names there
/// are, and what build() throws.
std::unique_ptr<Intersector> make_intersector(std::string_view name, refine::Triangles triangles,
                                              const IntersectorOptions& options = {});

/// The guards of the contract, for back-ends to call. check_fan also wants the fan's frame to be
/// unit vectors and its grid's sines and cosines within 1, so that no ray need be looked at by
/// itself (a grid once is enough); check_vertices looks at the vertices that faces use.
void check_ray(const Ray& ray);
void check_frame(const RayFan& fan);
void check_grid(const FanGrid& grid);
void check_fan(const RayFan& fan);
void check_fan(const RayFan& fan, std::span<const Hit> hits);
void check_vertices(refine::Triangles triangles, double largest_m = largest_component);

}  // namespace ensonify::engine
