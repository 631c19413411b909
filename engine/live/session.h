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

#include <ensonify/engine/base/memory.h>
#include <ensonify/engine/live/line_ring.h>
#include <ensonify/engine/scene/checks/extrapolation.h>

namespace ensonify::engine {

struct LiveOptions {
  std::filesystem::path scene;
  std::vector<std::string> overrides;  ///< as in read_scene()
  std::filesystem::path data_folder;
  std::optional<double> pings_per_s;  ///< 0: as fast as possible; unset: the scene's rate
  bool hold = false;                  ///< do not ping until a page ends the hold
  std::filesystem::path cache = {};   ///< for the seabed of the scene file, as in Preparation
  MemoryLimit memory = {};            ///< as in Preparation
  std::size_t ring_bytes = std::size_t{192} << 20;  ///< memory for lines that pages can scroll to
  /// Called with the stage of the preparation; if it throws, the preparation ends.
  std::function<void(std::string_view stage)> progress;
};

/// A scene that pings along its track, while pages show it and change its sonars, vehicle and
/// seabed. One thread pings. Another thread refines a separate mesh while a page shows it. Both
/// write to a ring and never wait for a reader. Nothing is written to disk, except the cache for
/// the seabed of the scene file.
///
/// Until something is changed, the lines are bit by bit those of a run of the scene.
class LiveSession {
 public:
  /// Makes the scene ready. Throws SceneError, refine::MeshError, std::invalid_argument.
  explicit LiveSession(LiveOptions options);
  ~LiveSession();  ///< calls stop()
  LiveSession(const LiveSession&) = delete;
  LiveSession& operator=(const LiveSession&) = delete;

  /// The scene's warnings. Only before start(); later warnings are troubles in the status frames.
  std::vector<std::string> warnings() const;
  Extrapolation extrapolation() const;  ///< values of the scene outside a model's range

  void start();  ///< begins to ping, on its own threads
  void stop();   ///< closes the ring and ends the threads
  /// The exception that ended the pings, if any.
  std::exception_ptr fault() const;

  LineRing& ring();

  /// Makes the changes that a JSON object requests. "set": {"a scene's key": value, ...}; if one of
  /// the keys changes the seabed, all keys change when the new seabed is ready. "hold": true stops
  /// the vehicle, false lets it continue. "pings_per_s": 0 for as fast as possible, null for the
  /// scene's rate. "again": true returns to the track's beginning. "add": the keys of an object,
  /// with "ahead_m" and "starboard_m" relative to the vehicle. "clear": true removes added objects.
  /// Throws std::invalid_argument or SceneError before anything is changed.
  void change(std::string_view json);

  /// The truth of a line's column, as JSON. Throws std::out_of_range if the line has no such column
  /// or is not in the ring.
  std::string truth(std::uint64_t line, std::size_t column) const;

  /// Counts an open page as long as this object exists; `mesh`: the page shows the mesh.
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
