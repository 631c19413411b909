#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/trace/intersector.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/refine/progressive_mesh.h>
#include <ensonify/refine/spare_threads.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// Which triangles are there for a ping, whatever intersects them. Faces keep their numbers in the
/// seafloor's mesh, and their corners' order. One thread at a time.
class FaceSource {
 public:
  virtual ~FaceSource() = default;
  /// The intersector over the faces that these fans can touch; good until the next call.
  virtual const Intersector& prepare(std::span<const RayFan> fans) = 0;
  /// The fans of a ping to come: what they need is made ready while what is there is used, if there
  /// is a spare thread. Whether what is there does for them, too, so that a later ping may be
  /// named.
  virtual bool expect(std::span<const RayFan>, refine::SpareThreads&) { return true; }
  /// What that intersector was built over: Hit::index counts in it.
  virtual refine::Triangles triangles() const = 0;
  /// Another number whenever those are others.
  virtual std::uint64_t version() const = 0;
  /// Forgets what earlier pings left.
  virtual void reset() {}
};

/// What the workers' surfaces are made from and share.
struct FaceSourceParts {
  refine::Triangles all;                                       ///< of the seafloor, for `static`
  std::shared_ptr<const Intersector> whole;                    ///< over them
  std::shared_ptr<const refine::ProgressiveMesh> progressive;  ///< for the others
  std::string intersector;                                     ///< which they build
  IntersectorOptions options;
  int tree_pings = 1;  ///< for how many pings to come a tree is meant to do
};

/// A kind of surface: its name for `--surface`, one line of help, which part it needs, and how to
/// make one worker's.
struct FaceSourceKind {
  std::string_view name;
  std::string_view help;
  bool needs_progressive_mesh;
  std::unique_ptr<FaceSource> (*make)(const FaceSourceParts& parts);
};
std::span<const FaceSourceKind> face_source_kinds();
std::vector<std::string_view> face_source_names();

/// The kind of that name. Throws std::invalid_argument, listing the names there are.
const FaceSourceKind& face_source_kind(std::string_view name);

/// The bytes for each face, in addition to the mesh, that making its parts takes at the peak: the
/// analysis, or the tree of an intersector over all faces. A lower bound, for many faces.
double build_bytes_per_face(const FaceSourceKind& surface, const IntersectorKind& intersector);

}  // namespace ensonify::engine
