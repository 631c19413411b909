#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/scene/track_poses.h>
#include <ensonify/engine/seafloor/bed_height.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/prepare.h>
#include <ensonify/engine/simulator/prepared_sonar.h>
#include <ensonify/engine/simulator/prepared_water.h>
#include <ensonify/engine/simulator/session_objects.h>
#include <ensonify/engine/sonar/echo/ping_tracer.h>
#include <ensonify/engine/sonar/echo/visibility_counter.h>
#include <ensonify/engine/stage_times.h>
#include <ensonify/engine/trace/face_source.h>
#include <ensonify/engine/trace/face_sources/faces_with_bodies.h>

namespace ensonify::engine {

using PreparedSonars = std::vector<std::shared_ptr<const PreparedSonar>>;

/// What all threads share.
struct Simulator::Ready {
  Ready(const Scene& of, const Preparation& how);

  /// One of the scene's sonars with these settings; see prepare_sonar(). Throws MemoryError for
  /// more rays than fit.
  std::shared_ptr<const PreparedSonar> prepare(std::size_t number, const Sonar& settings,
                                               const std::vector<std::string>& materials,
                                               std::vector<std::string>& its_warnings) const;
  Refraction refraction(const PreparedSonar& sonar) const;
  /// The scene's track over a bed of these heights. Throws SceneError.
  TrackPoses track_over(const std::function<double(double x_m, double y_m)>& bed_height_m) const;
  void take_recorded_track();
  void find_buried();

  Scene scene;
  MemoryLimit memory;
  int threads;  // that will ping
  std::shared_ptr<const PreparedSeafloor> prepared;
  const Seafloor& seafloor;
  refine::Bounds bounds;
  const BedGrid* bed = nullptr;  ///< unless the bed is in a progressive mesh
  FaceSourceParts parts;
  std::string code_path;
  PreparedWater water;
  std::optional<TrackPoses> recorded_track;  ///< of a file
  UsualPing usual_ping;
  std::vector<std::string> warnings;
  PreparedSonars sonars;
  std::vector<ObjectSurface> objects;
  std::vector<BuriedGroup> buried;  ///< of those
};

/// What one thread owns.
struct Simulator::Worker {
  explicit Worker(const Ready& ready);

  /// From now on pings with these.
  void use(PreparedSonars others, const Ready& ready);
  void count_object_visibility(const Ready& ready);
  void make_lines();
  /// Runs are not enough for its beams.
  bool needs_hits() const;

  FacesWithBodies face_source;
  std::optional<PlumbLine> plumb_line;  // where the bed is in a progressive mesh
  SessionObjects objects;
  std::vector<std::string> warnings;
  bool warned_of_distance = false;
  PreparedSonars prepared;
  std::vector<Sonar> sonars;  // of those
  struct BeamTracer {
    std::size_t sonar;
    Mounting mounting;  // of the beam
    PingTracer tracer;
    double height_m = 0.0;  // over the bed
  };
  std::vector<BeamTracer> beams;                       // of each sonar in turn
  std::vector<VisibilityCounter> visibility_counters;  // one per sonar, or none
  std::vector<RayFan> fans;                            // as the lines
  std::vector<EchoLine> lines;                         // of each beam in turn
  SignalChain::Scratch memory;
  std::uint64_t next_ping = 0;
  std::span<const Pose> expected;  // after the next ping
  refine::SpareThreads* spare = nullptr;
  StageTimes times;
};

}  // namespace ensonify::engine
