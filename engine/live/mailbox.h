#pragma once

#include <chrono>
#include <condition_variable>
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

/// Changes that pages requested and that the ping loop has not applied yet. The ping loop applies
/// them in the order of the members. The result is the same as in the order of the requests.
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
  int pages = 0, mesh_pages = 0;  ///< number of open pages, and of open pages that show the mesh
};

/// The values of a status frame that the ping loop does not have itself.
struct SessionStatus {
  Control control;
  bool preparing = false;            ///< a changed scene is being made ready
  std::string trouble;               ///< the latest trouble, a message for the user
  std::uint64_t trouble_number = 0;  ///< how many troubles there were
};

/// What the threads of a live session exchange: requests from pages to the ping loop, and troubles
/// from the ping loop to pages. Any thread may call any method. Each call is atomic, and only the
/// calls whose name begins with `wait` take long.
class Mailbox {
 public:
  Mailbox(SessionScene source, std::optional<double> pings_per_s, bool hold);

  // Pages.

  /// The session's scene with all changes so far, except of a seabed that is being prepared.
  SessionScene present() const { return copy_of(source_); }
  /// Passes a change to the ping loop. A change of the seabed instead begins a preparation, which
  /// ends with deliver() or give_up(). Throws std::invalid_argument, and changes nothing, if a
  /// preparation has already begun, or if too many objects wait to be added.
  void accept(const LiveChange& change);
  /// Adds `more` (1 or -1) to the number of open pages, and of pages that show the mesh if `mesh`.
  void count_page(int more, bool mesh);

  // The preparation of a changed scene.

  /// Call this when the scene of this change is ready. It makes the change, and then repeats the
  /// changes that were requested meanwhile.
  void deliver(std::shared_ptr<LiveScene> live_scene, const SceneChange& change);
  /// Call this when the scene cannot be made. Nothing of its change is made.
  void give_up(const std::string& trouble);

  // The ping loop.

  /// All pending changes; none when the session stops.
  std::optional<PendingChanges> take();
  Control control() const { return copy_of(status_.control); }
  SessionStatus status() const { return copy_of(status_); }
  /// Sets how the vehicle moves until a change.
  void set_vehicle(const Vehicle& vehicle);
  /// Waits until there are changes to take, at most this long.
  void wait_for_changes(std::chrono::milliseconds at_most);
  /// Waits until that time, or until the session stops.
  void wait_until(Clock::time_point due);
  /// Call this when the sonars of this change cannot be prepared. Their keys get their former
  /// values back, unless a key has changed again since. So later changes do not repeat the wrong
  /// values.
  void refuse(const SceneChange& change, const std::string& trouble);
  void fail(std::exception_ptr fault);

  // All threads.

  void report_trouble(const std::string& what);
  void stop();
  bool stopping() const { return copy_of(stopping_); }
  /// The exception that fail() has stored, if any.
  std::exception_ptr fault() const { return copy_of(fault_); }

 private:
  template <class Member>
  Member copy_of(const Member& member) const {
    const std::lock_guard lock(lock_);
    return member;
  }
  void note_trouble(const std::string& what);

  mutable std::mutex lock_;  // guards all members
  std::condition_variable woken_;
  SessionScene source_;
  std::vector<KeyValue> keys_meanwhile_;  // keys that changed since a preparation began
  VehicleChange vehicle_meanwhile_;
  PendingChanges pending_;
  bool changed_ = false, stopping_ = false;
  SessionStatus status_;
  std::exception_ptr fault_;
};

}  // namespace ensonify::engine
