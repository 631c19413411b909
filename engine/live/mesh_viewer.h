#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <ensonify/engine/live/live_scene.h>
#include <ensonify/engine/live/mesh_preview.h>

namespace ensonify::engine {

/// A thread that refines a mesh for the pages and posts it to the ring. The thread works at most a
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
