#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/prepare.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/scene/track_poses.h>
#include <ensonify/engine/sonar/echo/echo.h>
#include <ensonify/engine/sonar/echo/object_visibility.h>
#include <ensonify/engine/sonar/vehicle/track.h>
#include <ensonify/engine/trace/check/fan_comparison.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/engine/trace/refraction/refracted_tracer.h>
#include <ensonify/refine/spare_threads.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

class Recorder;

/// Seconds spent in a ping's stages, summed over pings.
struct StageTimes {
  double surface_s = 0.0;  ///< which triangles are there
  double trace_s = 0.0;    ///< nearest hits
  double echo_s = 0.0;     ///< scattering and binning
  double receive_s = 0.0;  ///< scatterers, noise and all to the recorder's samples
  StageTimes& operator+=(const StageTimes& other);
  StageTimes operator-(const StageTimes& other) const;
};

/// What a session puts into a scene, and moves: a vehicle, a buoy on its line, a diver.
struct MovingObject {
  /// Metres, z up, y where its heading points, about the point that a pose places. Both sides of
  /// its faces answer.
  refine::TriangleMesh mesh;
  std::string material = "steel";  ///< one of the scene's own, or a name that material.h knows
  std::string class_name = "object";
};

/// A scene made ready: the seafloor is there and its surface built. The whole pipeline on one page.
///
/// One thread at a time may use a Simulator, or any of several that were made from different
/// scenes; clone_for_thread() makes one more over the same seafloor, for a further thread, as the
/// scene has it. A ping depends on nothing but the scene, what was changed since, the pose and the
/// number. All exceptions come before anything is changed.
class Simulator {
 public:
  /// Throws SceneError, refine::MeshError, std::invalid_argument.
  explicit Simulator(const Scene& scene, const Preparation& how = {});
  Simulator(Simulator&&) noexcept;
  Simulator& operator=(Simulator&&) noexcept;
  ~Simulator();
  Simulator clone_for_thread() const;

  /// The next ping of a session, sent at a time from a pose: numbered from 0, else as below.
  std::span<const EchoLine> ping(double time_s, const Pose& pose);

  /// One ping of every sonar, the vehicle being at a pose: the sides of the first (port, then
  /// starboard, of those it has), then of the next. `number` tells pings apart in their random
  /// numbers. The lines are good until the next call. Throws
  /// std::invalid_argument for a pose that is not finite, or puts a sonar above the sea surface or
  /// below the bed (over a hole, or off the seafloor, it pings); refine::DamagedFile for a damaged
  /// seafloor's file.
  std::span<const EchoLine> ping(const Pose& pose, std::uint64_t number);

  /// The poses of the pings after the next one: while that is traced, a spare thread makes the
  /// surface ready for them. They must be there until then; other poses may come.
  void expect(std::span<const Pose> poses, refine::SpareThreads& spare);

  /// The lines of the last ping, to keep; the next one makes itself new ones. Empty before the
  /// first ping, and when they were taken.
  std::vector<EchoLine> take_lines();

  /// Other settings for a sonar of the scene, from the next ping on. Throws SceneError for settings
  /// that a scene's check refuses, std::invalid_argument for a number that no sonar has.
  void set_sonar(std::size_t number, const Sonar& settings);

  /// Puts an object into the scene, its mesh's y where the pose heads. Returns its instance, as the
  /// truth calls it: the lowest number that no other object has. Altitudes look through it. Throws
  /// std::invalid_argument for a material that nobody knows, a pose that is not finite, a mesh
  /// without faces, or more objects than labels have room for; refine::MeshError for a face whose
  /// vertex is not there or not finite.
  std::uint32_t add(MovingObject object, const Pose& pose);
  /// Throws std::invalid_argument for an instance that add() did not give, or that is gone, and as
  /// add().
  void move(std::uint32_t instance, const Pose& pose);
  void remove(std::uint32_t instance);

  /// The fans of a ping, in the order of its lines; good until the next call. Throws as ping().
  std::span<const RayFan> aim(const Pose& pose);

  /// What the fans of a ping meet, along straight rays: of each fan, in that order, a hit a ray.
  /// For who wants to compare intersectors. Throws as ping().
  std::vector<std::vector<Hit>> hits(const Pose& pose);

  /// Compares a ping of the scene with the exact reference, along straight rays: every hit and run
  /// of its fans, by the surface as it is, and the altitude below; of each sonar. The ping comes
  /// out as it would without. Objects that add() brought are unknown to the reference. Throws as
  /// ping().
  AgreementCounts verify(const Pose& pose);

  /// Forgets what earlier pings left in the surface. Pings do not depend on it; a block of them
  /// starts with it, so that memory and speed do not either.
  void reset();

  /// Height over the bed straight below, objects looked through, negative beneath it; NaN over a
  /// hole and off the seafloor.
  double altitude_m(const Eigen::Vector3d& position) const;

  /// The scene's track over this seafloor, the vehicle's pose at each ping. Throws SceneError.
  TrackPoses track_poses() const;
  std::vector<Pose> track() const;  ///< its poses alone

  const Seafloor& seafloor() const;
  /// How the seafloor came to be.
  const PreparedSeafloor& prepared() const;
  /// As they are set, with the bins of their digitisers.
  std::span<const Sonar> sonars() const;
  /// What the truth's class and sediment numbers mean: the seafloor's, then what add() brought.
  std::span<const std::string> classes() const;
  std::span<const std::string> materials() const;
  /// What should be said once: repairs, odd parameters, a short cast; extrapolation.h has more to
  /// say.
  std::span<const std::string> warnings() const;
  /// What the intersector's last bits depend on.
  std::string_view code_path() const;
  double absorption_db_per_m(std::size_t sonar) const;
  double sound_speed_mps() const;  ///< that ranges are counted by
  /// What a sonar's samples stand for.
  const Recorder& recorder(std::size_t sonar) const;
  /// What a display of it needs; good as long as its settings.
  const Calibration& calibration(std::size_t sonar) const;
  /// From now on pings count what they see of each object, and so do those of clone_for_thread():
  /// it takes some of their time where many objects are in view. Bent rays (sea.refraction =
  /// "full") are not counted.
  void count_object_visibility();
  /// What was counted of a sonar's pings, one an object; nothing if nothing was.
  std::span<const ObjectView> object_visibility(std::size_t sonar) const;
  /// What became of this Simulator's refracted rays.
  RefractionCounts refraction_counts() const;
  const StageTimes& times() const;

 private:
  struct Ready;   // what all threads share
  struct Worker;  // one thread's own
  explicit Simulator(std::shared_ptr<const Ready> ready);
  double bed_height_m(double x_m, double y_m) const;
  std::size_t mesh_of(std::uint32_t instance) const;
  void look_ahead(refine::SpareThreads& spare);
  std::shared_ptr<const Ready> ready_;
  std::unique_ptr<Worker> worker_;
};

}  // namespace ensonify::engine
