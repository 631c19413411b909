#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/base/calls_at_fork.h>
#include <ensonify/engine/scene/track_poses.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/prepare.h>
#include <ensonify/engine/simulator/prepared_sonar.h>
#include <ensonify/engine/simulator/session_objects.h>
#include <ensonify/engine/sonar/echo/ping_tracer.h>
#include <ensonify/engine/sonar/echo/visibility_counter.h>
#include <ensonify/engine/stage_times.h>
#include <ensonify/refine/standard_floats.h>

namespace ensonify::engine {

using PreparedSonars = std::vector<std::shared_ptr<const PreparedSonar>>;

/// Heights between which everything lies that rays can hit.
struct HeightRange {
  double highest_m = 0.0, lowest_m = 0.0;
  bool operator==(const HeightRange&) const = default;
};

/// What all threads share.
struct Simulator::SharedState {
  SharedState(const Scene& of, const Preparation& how);

  /// One of the scene's sonars with these settings; see prepare_sonar().
  std::shared_ptr<const PreparedSonar> prepare(std::size_t number, const Sonar& settings,
                                               const UsualPing& usual,
                                               const std::vector<std::string>& materials,
                                               std::vector<std::string>& its_warnings) const;
  HeightRange heights(const SessionObjects& added) const;
  Refraction refraction(const PreparedSonar& sonar, const HeightRange& heights) const;
  /// The scene's track over this bed. Throws SceneError.
  TrackPoses track_over(BedHeight& bed) const;
  /// Throws if the caller wants to stop.
  void stop_check() const {
    if (parts.options.stop_check) parts.options.stop_check();
  }
  void take_recorded_track();
  void find_buried();

  Scene scene;
  MemoryLimit memory;
  std::shared_ptr<const PreparedSeafloor> prepared;
  const Seafloor& seafloor;
  refine::Bounds bounds;         // as Seafloor::bounds()
  HeightRange seafloor_heights;  // wider where the heights of the bed are estimates
  FaceSourceParts parts;
  std::string code_path;
  PreparedWater water;
  std::optional<TrackPoses> recorded_track;  ///< of a file
  UsualPing usual_ping;
  std::vector<std::string> warnings;
  std::vector<double> bed_shares;  ///< of the bed's materials
  PreparedSonars sonars;
  std::vector<ObjectSurface> objects;
  std::vector<BuriedGroup> buried;  ///< of these objects
  mutable CallsAtFork calls;        ///< of all its Simulators
};

/// What each call of a Simulator needs first.
struct Simulator::Entry {
  explicit Entry(const SharedState& shared) : call(shared.calls) {}
  refine::StandardFloats floats;
  CallsAtFork::Call call;
};

/// Where all sonars look at a ping.
struct Simulator::Aim {
  std::vector<FanAim> fans;       // of each sonar in turn
  std::vector<RayFan> fans_only;  // the same, for face sources
};

/// What one thread owns.
struct Simulator::ThreadState {
  explicit ThreadState(const SharedState& shared);

  /// Pings with these sonars from now on.
  void use(PreparedSonars others, const SharedState& shared);
  /// Adapts the tracers to the present places of the added objects. Each aim() calls it.
  void follow_objects(const SharedState& shared);
  void count_object_visibility(const SharedState& shared);
  void make_lines();
  /// The faces of the fans in `aim`, in the form that the tracers need.
  TracedFaces prepare_faces();
  /// Makes the samples of a sonar's lines from their expected echoes.
  void receive(std::size_t sonar, const Pose& pose, std::uint64_t ping,
               std::span<const FanAim> fans, std::span<EchoLine> of_sonar);

  FacesWithBodies face_source;
  BedHeight bed;
  SessionObjects objects;
  std::vector<std::string> warnings;
  bool warned_of_distance = false;
  UsualPing usual_ping;
  HeightRange heights;
  PreparedSonars prepared;
  std::vector<Sonar> sonars;  // of `prepared`
  std::vector<PingTracer> tracers_of(const PreparedSonars& of, const HeightRange& range,
                                     const SharedState& shared);
  std::vector<PingTracer> tracers;                     // by sonar
  std::vector<VisibilityCounter> visibility_counters;  // one per sonar, or none
  std::vector<EchoLine> lines;                         // of each sonar in turn
  Aim aim, aim_ahead;                                  // of the ping; of an announced ping
  std::vector<LineContext> contexts;                   // of the lines that are received together
  SignalChain::Scratch chain_scratch;
  std::uint64_t next_ping = 0;
  struct Announced {
    std::span<const Pose> poses;
    std::span<const std::size_t> pings;
  };
  Announced announced;  // after the next ping
  refine::SpareThreads* spare = nullptr;
  StageTimes times;
};

}  // namespace ensonify::engine
