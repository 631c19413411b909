#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <ensonify/engine/base/clock.h>
#include <ensonify/engine/live/change.h>
#include <ensonify/engine/live/live_scene.h>

namespace ensonify::engine {

/// Changes that pages requested and that the ping loop has not applied yet. A new scene comes
/// first, then the others in the order of the members, which gives the same as the pages' order.
struct PendingChanges {
  std::shared_ptr<LiveScene> live_scene;
  std::optional<SceneChange> sonars;  ///< all changes of sonars, as one
  std::optional<Display> display;
  bool clear = false;
  std::vector<AddedObject> objects;
  bool again = false;
  std::vector<AddedObject> objects_after_again;
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

  /// The session's scene with all changes so far, except of a seabed that is being prepared.
  SessionScene present() const;
  /// Passes a change on to the ping loop. One of the seabed begins a preparation instead, which
  /// ends with deliver() or give_up(). Throws std::invalid_argument, and changes nothing, if one
  /// has begun already, or if too many objects wait to be added.
  void accept(const LiveChange& change);
  void page_opened(bool mesh);
  void page_closed(bool mesh);

  // The preparation of a changed scene.

  /// The scene of this change is ready: the change is made, and after it once more those that came
  /// meanwhile.
  void deliver(std::shared_ptr<LiveScene> live_scene, const SceneChange& change);
  /// The scene cannot be made: nothing of its change is.
  void give_up(const std::string& trouble);

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
  void note_trouble(const std::string& what);

  mutable std::mutex lock_;  // of all members
  std::condition_variable woken_;
  SessionScene source_;
  std::vector<KeyValue> keys_meanwhile_;  // that changed while a scene is made ready
  VehicleChange vehicle_meanwhile_;
  PendingChanges pending_;
  bool changed_ = false, stopping_ = false;
  SessionStatus status_;
  std::exception_ptr fault_;
};

}  // namespace ensonify::engine
