#pragma once

#include <memory>
#include <span>

#include <ensonify/engine/live/frames.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/refine/active_mesh.h>
#include <ensonify/refine/fan_volume.h>

namespace ensonify::engine {

/// What the last refinement for a view did, and what there is after it.
struct MeshCounts {
  std::size_t splits = 0, collapses = 0;
  std::size_t active_faces = 0, exact_faces = 0;
};

/// An active mesh of its own for the eye, refined for the pings that are shown.
class MeshPreview {
 public:
  /// Analyses the seafloor unless it has been. The seafloor must outlive it. Throws as
  /// make_progressive_mesh().
  explicit MeshPreview(const Seafloor& seafloor);

  /// Refines for a ping's fans, and gives the faces within so far of their apex over ground, not
  /// all of the exact ones where there are too many.
  MeshPatch look(std::span<const refine::FanVolume> volumes, double within_m);
  const MeshCounts& counts() const { return counts_; }

 private:
  std::shared_ptr<const refine::ProgressiveMesh> progressive_;
  std::unique_ptr<refine::ActiveMesh> mesh_;
  MeshCounts counts_;
};

}  // namespace ensonify::engine
