#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/trace/intersector.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/engine/trace/traced_faces.h>
#include <ensonify/refine/progressive_mesh.h>
#include <ensonify/refine/spare_threads.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::refine {
class BallTree;
class HeightGrid;
class MeshClusters;
}  // namespace ensonify::refine

namespace ensonify::engine {

/// Provides the triangles for a ping, for any intersector. Faces keep their numbers in the
/// seafloor's mesh, and the order of their corners. Only one thread at a time may use it.
class FaceSource {
 public:
  virtual ~FaceSource() = default;
  /// The faces that these fans can touch; valid until the next call.
  virtual Faces prepare(std::span<const RayFan> fans) = 0;
  /// Like prepare(), but may return FoundRuns, which cost less where the echo needs no hits.
  virtual TracedFaces prepare_runs(std::span<const RayFan> fans) { return prepare(fans); }
  /// Like prepare(), for bent rays: may return BedAndObjects. The fans must exist as long as the
  /// result.
  virtual TracedFaces prepare_bed(std::span<const RayFan> fans) { return prepare(fans); }
  /// Announces the fans of a later ping. If a spare thread is free, it prepares the faces of these
  /// fans while the current faces are in use. Returns true if the current faces are enough for
  /// these fans too; the caller may then announce the ping after that one.
  virtual bool announce(std::span<const RayFan>, refine::SpareThreads&) { return true; }
  /// Forgets all state of earlier pings.
  virtual void reset() {}
};

// The names of the kinds of face sources.
inline constexpr std::string_view static_surface = "static";
inline constexpr std::string_view refined_surface = "refined";
inline constexpr std::string_view footprint_surface = "footprint";

/// The data that the face sources of all workers share.
struct FaceSourceParts {
  refine::Triangles all;                     ///< of the seafloor, for `static`
  std::shared_ptr<const Intersector> whole;  ///< over all triangles
  /// For `refined` and `footprint`.
  std::shared_ptr<const refine::ProgressiveMesh> progressive;
  /// For `footprint`, instead of the progressive mesh: a bed of heights, and the objects on it.
  std::shared_ptr<const refine::HeightGrid> grid;
  std::shared_ptr<const refine::BallTree> objects;
  /// For `refined`, instead of the progressive mesh: a bed of heights and the objects on it, in
  /// clusters.
  std::shared_ptr<refine::MeshClusters> clusters;
  std::string intersector;  ///< the back-end that they build
  IntersectorOptions options;
  int tree_pings = 1;  ///< the number of pings that each tree should serve
};

/// A kind of face source: its name for `--surface`, one line of help, which part it needs, and how
/// to make one worker's instance.
struct FaceSourceKind {
  std::string_view name;
  std::string_view help;
  bool needs_progressive_mesh;
  bool takes_grid;  ///< uses a grid of heights instead, if the bed is one
  std::unique_ptr<FaceSource> (*make)(const FaceSourceParts& parts);
};
std::span<const FaceSourceKind> face_source_kinds();
std::vector<std::string_view> face_source_names();

/// The kind of that name; - and _ are alike. Throws std::invalid_argument, listing the names.
const FaceSourceKind& face_source_kind(std::string_view name);

/// Peak memory, in bytes per face and in addition to the mesh, for making the parts of a face
/// source: the analysis, or an intersector's tree over all faces. A lower bound for large meshes.
double build_bytes_per_face(const FaceSourceKind& surface, const IntersectorKind& intersector);

}  // namespace ensonify::engine
