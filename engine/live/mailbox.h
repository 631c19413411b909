#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <ensonify/engine/clock.h>
#include <ensonify/engine/live/change.h>
#include <ensonify/engine/live/live_scene.h>

namespace ensonify::engine {

/// Changes that pages requested and that the ping loop has not applied yet. A new scene comes
/// first, then the others in the order of the members.
struct PendingChanges {
  std::shared_ptr<LiveScene> live_scene;
  std::optional<SceneChange> sonars;  ///< all changes of sonars, as one
  std::optional<Display> display;
  bool clear = false;
  std::vector<AddedObject> objects;
  bool again = false;
};

/// How the vehicle is to continue, and which pages are open.
struct Control {
  Vehicle vehicle;
  std::optional<double> pings_per_s;  ///< as in LiveOptions
  bool hold = false;
  int pages = 0, mesh_pages = 0;  ///< open pages, and those of them that show the mesh
};

/// The part of a status frame that the ping loop does not have.
struct SessionStatus {
  Control control;
  bool preparing = false;  ///< a changed scene is being made ready
  std::string trouble;     ///< the latest
  std::uint64_t trouble_number = 0;
};

/// What the threads of a live session exchange: requests from pages to the ping loop, and troubles
/// back. Any thread may call any method. Each call is atomic, and only the calls that wait take
/// long.
class Mailbox {
 public:
  Mailbox(SessionScene source, std::optional<double> pings_per_s, bool hold);

  // Pages.

  /// The session's scene with all changes so far, and where its vehicle is to be.
  std::pair<SessionScene, Vehicle> present() const;
  /// Passes a change on to the ping loop. One that changes the seabed also begins a preparation,
  /// which ends with deliver() or give_up(). Throws std::invalid_argument, and changes nothing, if
  /// one has begun already, or if too many objects wait to be added.
  void accept(const LiveChange& change);
  void page_opened(bool mesh);
  void page_closed(bool mesh);

  // The preparation of a changed scene.

  void deliver(std::shared_ptr<LiveScene> live_scene);
  /// The scene of this change cannot be made: later changes do not repeat its values.
  void give_up(const SceneChange& change, const std::string& trouble);

  // The ping loop.

  /// All pending changes; none when the session stops.
  std::optional<PendingChanges> take();
  Control control() const;
  SessionStatus status() const;
  /// Sets how the vehicle moves until a change.
  void set_vehicle(const Vehicle& vehicle);
  /// Waits until there are changes to take, at most this long.
  void wait_for_changes(std::chrono::milliseconds at_most);
  /// Waits until that time, or until the session stops.
  void wait_until(Clock::time_point due);
  /// The sonars of this change cannot be prepared: later changes do not repeat their values.
  void refuse(const SceneChange& change, const std::string& trouble);
  void fail(std::exception_ptr fault);

  // All threads.

  void report_trouble(const std::string& what);
  void stop();
  bool stopping() const;
  /// What fail() was called with.
  std::exception_ptr fault() const;

 private:
  void take_back(std::span<const KeyValue> keys, const SceneChange& change,
                 const std::string& trouble);

  mutable std::mutex lock_;  // of all members
  std::condition_variable woken_;
  SessionScene source_;
  std::vector<SceneChange> meanwhile_;  // of sonars, while a scene is made ready
  PendingChanges pending_;
  bool changed_ = false, stopping_ = false;
  SessionStatus status_;
  std::exception_ptr fault_;
};

}  // namespace ensonify::engine
