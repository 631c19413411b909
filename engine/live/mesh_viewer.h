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

/// The thread that refines a mesh for those who look, and posts it. It takes a quarter of a core at
/// most.
class MeshViewer {
 public:
  /// Both are used from its thread; `trouble` is told why a mesh cannot be shown.
  MeshViewer(LineRing& ring, std::function<void(const std::string& what)> trouble);
  ~MeshViewer();  ///< ends it

  /// Shows what these see, unless something newer is asked for first.
  void show(std::shared_ptr<const LiveScene> world, std::vector<refine::FanVolume> volumes);

  /// Of what was posted last; none: nothing was.
  std::optional<MeshCounts> counts() const;

 private:
  struct Wanted {
    std::shared_ptr<const LiveScene> world;
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
