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

/// A thread that refines a mesh for the pages and posts it to the ring. It uses at most a quarter
/// of a core.
class MeshViewer {
 public:
  /// Both are used on the new thread; `trouble` is called with the reason if a mesh cannot be
  /// shown.
  MeshViewer(LineRing& ring, std::function<void(const std::string& what)> trouble);
  ~MeshViewer();  ///< ends the thread

  /// Shows what these volumes see, unless a newer call replaces this one first.
  void show(std::shared_ptr<const LiveScene> scene, std::vector<refine::FanVolume> volumes);

  /// The counts of the mesh posted last; none before the first one.
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
