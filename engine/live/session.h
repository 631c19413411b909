#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/live/line_ring.h>
#include <ensonify/engine/memory.h>

namespace ensonify::engine {

/// A scene and how it is to be shown.
struct LiveOptions {
  std::filesystem::path scene;
  std::vector<std::string> overrides;  ///< as in read_scene()
  std::filesystem::path data_folder;
  std::optional<double> pings_per_s;  ///< 0: as fast as they come; unset: the scene's own
  bool hold = false;                  ///< whether it starts paused
  MemoryLimit memory = {};            ///< as in Preparation
  std::size_t ring_bytes = std::size_t{192} << 20;  ///< for the lines that pages can go back to
  /// Called with each stage while the scene is made ready; what it throws ends that.
  std::function<void(std::string_view stage)> progress;
};

/// A scene that pings along its track while pages watch. Its sonar, vehicle and seabed can change
/// meanwhile. One thread pings, another refines a mesh for the view while a page shows it; they
/// write their results into a ring and wait for no page. Nothing is written to disk.
///
/// While nothing is changed its lines are those of a run of the scene, to the last bit.
class LiveSession {
 public:
  /// Makes the scene ready. Throws SceneError, refine::MeshError, std::invalid_argument.
  explicit LiveSession(LiveOptions options);
  ~LiveSession();  ///< stops
  LiveSession(const LiveSession&) = delete;
  LiveSession& operator=(const LiveSession&) = delete;

  void start();  ///< pings from now on, on its own threads
  void stop();   ///< closes the ring and ends the threads
  /// The exception that ended the pings, if one did.
  std::exception_ptr fault() const;

  LineRing& ring();

  /// Changes what a JSON object says: "set": {"a scene's key": value, ...}; "hold": whether it
  /// pauses; "pings_per_s": 0 for as fast as they come, null for the scene's own; "again":
  /// true, back to the track's beginning; "add": an object's keys, with "ahead_m" and "starboard_m"
  /// from the vehicle; "clear": true, takes those out. Throws std::invalid_argument and SceneError,
  /// before anything is changed.
  void change(std::string_view json);

  /// What is known of a column of a line, as JSON. Throws std::out_of_range where there is none
  /// (any more).
  std::string truth(std::uint64_t line, std::size_t column) const;

  /// A page that shows the mesh, as long as it lives.
  class Watch {
   public:
    explicit Watch(LiveSession& session, bool mesh);
    ~Watch();
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;

   private:
    LiveSession& session_;
    bool mesh_;
  };

 private:
  struct Inner;
  std::unique_ptr<Inner> inner_;
};

}  // namespace ensonify::engine
