#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include <ensonify/engine/scene/track_poses.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/prepare.h>
#include <ensonify/engine/simulator/prepared_sonar.h>
#include <ensonify/engine/sonar/echo/visibility_counter.h>
#include <ensonify/engine/stage_times.h>
#include <ensonify/engine/trace/check/fan_comparison.h>
#include <ensonify/refine/spare_threads.h>

namespace ensonify::engine {

/// What a run, the live view, `check` and the benchmark need of a Simulator. Not installed:
/// programs that link the library do not need it. The Simulator's thread rule holds for all of it.
struct SimulatorInternals {
  /// Announces the pings after the next ping. `pings`: their indices in `poses`; an index beyond
  /// the end is left out. While the next ping is traced, a spare thread prepares the faces for
  /// them. Keep `poses`, `pings` and `spare` alive until the end of the next ping. The pings that
  /// follow need not have these poses.
  static void announce(Simulator& simulator, std::span<const Pose> poses,
                       std::span<const std::size_t> pings, refine::SpareThreads& spare);

  /// Makes the face source forget earlier pings. This changes no ping. A run calls it before each
  /// block of pings, so that memory and speed do not depend on earlier blocks.
  static void reset(Simulator& simulator);

  /// The fans of a ping, in the order of its lines; valid until the next call. Throws as
  /// ping_numbered().
  static std::span<const RayFan> aim(Simulator& simulator, const Pose& pose);

  /// The nearest hit of every ray of each fan that aim() returns, in this order, along straight
  /// rays. Throws as ping_numbered().
  static std::vector<std::vector<Hit>> hits(Simulator& simulator, const Pose& pose);

  /// Compares a ping of the scene with the exact reference, along straight rays: every hit and run
  /// of all sonars' fans, with the face source in its present state. Also compares the height of
  /// the bed. It does not change the next ping. Objects that move and objects that add() added
  /// are left out. Throws as ping_numbered().
  static AgreementCounts verify(Simulator& simulator, const Pose& pose);

  /// The scene's track with its warnings. Throws SceneError.
  static TrackPoses track_poses(const Simulator& simulator);

  /// The scene's usual altitude, speed and ping interval; for a recorded track, the medians.
  static const UsualPing& usual_ping(const Simulator& simulator);

  /// How the seafloor was made.
  static const PreparedSeafloor& prepared(const Simulator& simulator);
  /// The intersector over all faces; null unless the face source is `static`.
  static std::shared_ptr<const Intersector> whole(const Simulator& simulator);
  /// The code path: what the last bits of the intersector's results depend on.
  static std::string_view code_path(const Simulator& simulator);

  /// The recorder of a sonar, which converts its samples; and its full scale by beam.
  static const Recorder& recorder(const Simulator& simulator, std::size_t sonar);
  static std::vector<FullScale> full_scale_by_beam(const Simulator& simulator, std::size_t sonar);

  /// From now on, pings count what they see of each object, also the pings of clones by
  /// clone_for_thread(). This takes part of their time if many objects are in view. Bent rays
  /// (sea.refraction = "full") are not counted.
  static void count_object_visibility(Simulator& simulator);
  /// What was counted of a sonar's pings, one per object of the seafloor; empty where nothing was.
  static std::span<const ObjectVisibility> object_visibility(const Simulator& simulator,
                                                             std::size_t sonar);
  /// The water that bends the rays of this Simulator's pings. It differs between sonars only in
  /// absorption. The profile belongs to this Simulator.
  static Refraction refraction(const Simulator& simulator);
  /// Counts of how this Simulator's bent rays were decided.
  static RefractionCounts refraction_counts(const Simulator& simulator);
  static const StageTimes& times(const Simulator& simulator);
};

}  // namespace ensonify::engine
