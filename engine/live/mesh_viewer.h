#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <ensonify/engine/base/memory.h>
#include <ensonify/engine/live/frames.h>
#include <ensonify/engine/live/live_scene.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/refine/active_mesh.h>
#include <ensonify/refine/fan_volume.h>

namespace ensonify::engine {

/// The operations of the last refinement, and the faces after it.
struct MeshCounts {
  std::size_t splits = 0, collapses = 0;
  std::size_t active_faces = 0, exact_faces = 0;
};

/// A separate active mesh for display, refined for the pings that are shown.
class MeshPreview {
 public:
  /// Makes the progressive mesh if the seafloor has none. The seafloor must outlive this object.
  /// `stop_check` is called during this work; what it throws ends the work. Throws as
  /// make_progressive_mesh(), Error for a bed in tiles, and MemoryError for a bed that does not fit
  /// into the memory.
  MeshPreview(const Seafloor& seafloor, const MemoryLimit& memory,
              const std::function<void()>& stop_check);

  /// Refines the mesh for a ping's fans. Returns the faces within this horizontal distance of the
  /// fans' apex: at most 80,000, first the coarse faces and then the exact ones.
  MeshPatch look(std::span<const refine::FanVolume> volumes, double within_m);
  const MeshCounts& counts() const { return counts_; }

 private:
  std::shared_ptr<const refine::ProgressiveMesh> progressive_;
  std::unique_ptr<refine::ActiveMesh> mesh_;
  MeshCounts counts_;
};

/// A thread that refines a mesh for pages and posts it to the ring. The thread works at most a
/// quarter of the time.
class MeshViewer {
 public:
  /// The new thread uses both arguments. It calls `trouble` with the reason if a mesh cannot be
  /// shown.
  MeshViewer(LineRing& ring, std::function<void(const std::string& what)> trouble);
  ~MeshViewer();  ///< ends the thread

  /// Asks for the faces that these volumes reach. A newer call replaces a request that still waits.
  void show(std::shared_ptr<const LiveScene> scene, std::vector<refine::FanVolume> volumes);

  /// The counts of the mesh that was posted last; none before the first mesh.
  std::optional<MeshCounts> counts() const;

 private:
  struct Wanted {
    std::shared_ptr<const LiveScene> scene;
    std::vector<refine::FanVolume> volumes;
  };
  void work();

  LineRing& ring_;
  std::function<void(const std::string& what)> trouble_;
  mutable std::mutex lock_;
  std::condition_variable woken_;
  Wanted wanted_;
  std::optional<MeshCounts> counts_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace ensonify::engine
