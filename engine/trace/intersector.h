#pragma once

#include <cstdint>
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

/// The largest allowed component of a ray or a vertex. (Embree's own limit is a little higher.)
inline constexpr double largest_component = 1e18;

/// Finds nearest hits over the triangles it was built with. Queries are const and may run on any
/// number of threads at once, but not during build().
///
/// The contract, the same for every back-end (tests/contract):
/// - Both sides of a face are hit.
/// - A hit has t_min <= t <= t_max.
/// - Of several faces at one distance the lowest number wins, then the first in order.
/// - A degenerate face is never hit; in an empty mesh all rays miss.
/// - Hit::face is the face's number, Hit::index its index among the triangles.
/// - A hit depends on the ray and on the faces that the ray meets: not on other faces, on the order
///   of faces, or on how vertices are numbered. (Embree's may in rare cases, see embree.h.)
/// - Rays that are not finite or huge (above 1e18), zero directions and negative t_min throw
///   std::invalid_argument.
class Intersector {
 public:
  virtual ~Intersector() = default;

  /// Replaces the triangles. They must outlive the queries and not change. Throws
  /// refine::MeshError for a face whose vertex does not exist, is not finite, or is beyond the
  /// back-end's limit (1e18 m, embree 1e9 m); std::bad_alloc or std::runtime_error if memory or a
  /// library fails. After an exception it is empty and may be built again.
  virtual void build(refine::Triangles triangles) = 0;

  /// What its last bits depend on in addition to its libraries: an instruction set ("avx2", or
  /// "avx2 fast" if not robust), or "portable".
  virtual std::string_view code_path() const = 0;

  /// hits[fan.ray number], a miss for rays outside the beam. hits.size() == planes * elevations.
  virtual void intersect(const RayFan& fan, std::span<Hit> hits) const = 0;
  /// Writes the hits as runs, if the back-end finds runs directly. Otherwise returns false, and the
  /// caller makes the runs from the hits.
  virtual bool list_runs(const RayFan&, FanRuns&) const { return false; }
  /// hits[i] belongs to rays[i]; there are as many hits as rays.
  virtual void intersect(std::span<const Ray> rays, std::span<Hit> hits) const = 0;
};

/// The precision of an intersector, which limits how far off a sound answer may be.
enum class Precision {
  exact,      ///< the reference's own test: the same bits
  in_double,  ///< double; at an edge within its rounding the face may differ
  in_float    ///< rounding of float about an origin near the mesh
};

/// A back-end: its name, one line of help, and how to make one, empty until it is built.
struct IntersectorKind {
  std::string_view name;
  std::string_view help;
  std::unique_ptr<Intersector> (*make)(const IntersectorOptions& options);
  bool takes_lists = true;  ///< whether it traces lists of rays; otherwise only fans
  Precision precision = Precision::in_float;
  /// Peak memory of build() per face of a large mesh, in addition to the mesh. A lower bound,
  /// measured over 2.4 million faces and rounded down; 0: not measured.
  double bytes_per_face = 0.0;
  bool builds_tree = false;       ///< a tree over static faces can save time over many pings
  bool tests_every_face = false;  ///< for every ray: too slow for many faces and rays
};
/// The name of the kind that all others are compared with.
inline constexpr std::string_view reference_intersector = "pluecker";

/// The kinds of the library, then those of program_intersector_kinds(). Throws
/// std::invalid_argument if a kind of the program has no name, no `make`, or the name of another
/// kind (- and _ are equal).
std::span<const IntersectorKind> intersector_kinds();

/// The back-ends of the program that links the library. The library has a definition that returns
/// none; a program that adds back-ends defines this function again, in a source of the
/// executable itself (the linker may omit it from a static library). It is called once,
/// before the first intersector is looked up; what it returns must live as long as the program.
std::span<const IntersectorKind> program_intersector_kinds();

/// The kind of that name; - and _ are equal. Throws std::invalid_argument, which lists the names,
/// and what intersector_kinds() throws.
const IntersectorKind& intersector_kind(std::string_view name);

/// The back-end of that name over triangles. Throws as intersector_kind and build() do.
std::unique_ptr<Intersector> make_intersector(std::string_view name, refine::Triangles triangles,
                                              const IntersectorOptions& options = {});

/// Checks of the contract's preconditions, for back-ends to call: check_vertices throws
/// refine::MeshError, the others throw std::invalid_argument. check_fan also requires unit
/// vectors in the fan's frame and sines and cosines within 1 in its grid, so that no ray needs a
/// separate check (a grid is checked once); check_vertices reads the vertices that faces use.
void check_ray(const Ray& ray);
void check_frame(const RayFan& fan);
void check_grid(const FanGrid& grid);
void check_fan(const RayFan& fan);
void check_fan(const RayFan& fan, std::span<const Hit> hits);
void check_vertices(refine::Triangles triangles, double largest_m = largest_component);

}  // namespace ensonify::engine
