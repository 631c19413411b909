#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <ensonify/engine/base/clock.h>
#include <ensonify/engine/image/display.h>
#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/live/line_ring.h>
#include <ensonify/engine/live/live_scene.h>
#include <ensonify/engine/live/mailbox.h>
#include <ensonify/engine/live/mesh_viewer.h>
#include <ensonify/engine/stage_times.h>

namespace ensonify::engine {

/// Pings along a scene's track, applies the changes that the mailbox has, and publishes lines and
/// status in the ring. One thread owns it; the mailbox and the ring are all that it shares.
class PingLoop {
 public:
  /// Publishes the scene's bed and setting. `name` is the scene's name. The mailbox and the ring
  /// must outlive this object.
  PingLoop(std::shared_ptr<LiveScene> live_scene, std::string name, Mailbox& mailbox,
           LineRing& ring);

  /// Pings until the mailbox stops. Passes an exception to the mailbox, and closes the ring.
  void run();

  /// Must not be called during run().
  const LiveScene& live_scene() const { return *live_scene_; }

 private:
  struct ObjectOnBed {
    MovingObject object;
    Pose place;
    std::uint32_t instance;
  };

  bool at_end() const;
  void apply(PendingChanges changes);
  void replace_scene(std::shared_ptr<LiveScene> live_scene);
  void put(AddedObject& added);
  void set_down(MovingObject object, Pose place);
  void take_setting();
  void report_new_warnings();

  void ping(const Control& control, MeshViewer& viewer);
  TrackPings::PingRecord record_ping(double per_ping);
  void publish(const TrackPings::PingRecord& ping);
  void show_mesh(const Pose& pose, MeshViewer& viewer);
  void report_status(bool at_rest, const MeshViewer& viewer);
  double wanted_rate(const Control& control) const;

  Mailbox& mailbox_;
  LineRing& ring_;
  std::string name_;
  std::shared_ptr<LiveScene> live_scene_;
  const Vehicle planned_;  // altitude and speed of the track over the first scene's bed
  Display display_;

  // Made by take_setting() from the scene, its objects and the display.
  std::vector<Renderer> renderers_;
  std::vector<Waterfall> rows_;
  Bytes setting_;
  std::shared_ptr<const std::vector<std::string>> classes_, materials_;

  std::vector<std::string> warnings_;  // warnings that were reported
  std::vector<ObjectOnBed> added_;     // objects that pages added
  double along_ = 0.0;                 // place on the track, counted in its pings
  double climbed_m_ = 0.0;             // height of the vehicle above the track
  bool on_track_ = true;               // all pings so far are the same as in a run
  bool out_of_water_ = false;
  std::uint64_t pings_ = 0, lines_ = 0;

  // Of the last status, and since then.
  std::uint64_t pings_since_ = 0;
  StageTimes stages_before_;
  Clock::time_point status_reported_{};
  Clock::time_point view_due_{};
};

}  // namespace ensonify::engine
