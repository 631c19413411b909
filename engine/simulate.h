#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/moving_object.h>
#include <ensonify/engine/preparation.h>
#include <ensonify/engine/sonar/echo/echo.h>
#include <ensonify/engine/sonar/instrument/sonar.h>
#include <ensonify/engine/sonar/vehicle/track.h>

// The libraries are static and promise no binary interface: build a program against the headers of
// the library that it links.

namespace ensonify::refine {
class SpareThreads;
}

namespace ensonify::engine {

struct Calibration;         // image/display.h
struct Scene;               // scene/scene.h; scene/reader.h reads one
struct Seafloor;            // seafloor/seafloor.h
struct SimulatorInternals;  // simulator/internals.h

/// A scene made ready: its seafloor is there, and pings can be made from any pose.
///
/// Not thread-safe: one thread at a time per Simulator. Distinct Simulators may run concurrently,
/// also where they share a seafloor. clone_for_thread() returns one that shares this one's
/// seafloor, with the scene's original settings and without objects that were added. A ping depends
/// only on the scene, what was changed since, the pose and the ping's number. An exception comes
/// before anything is changed, except one of the stop_check, after which lines are not complete.
/// A child of fork() may use the Simulators of its parent. If a thread was in a call of one of
/// those that share a seafloor, all of them throw std::runtime_error in the child. The caller's
/// rounding mode, flush-to-zero flags and floating-point traps have no effect, and stay as they
/// are.
class Simulator {
 public:
  /// Throws SceneError, refine::MeshError, MemoryError, std::invalid_argument.
  explicit Simulator(const Scene& scene, const Preparation& how = {});
  Simulator(Simulator&&) noexcept;
  Simulator& operator=(Simulator&&) noexcept;
  ~Simulator();
  /// One for another thread, see above. Throws std::bad_alloc.
  Simulator clone_for_thread() const;

  /// The next ping of the session, sent at pose.t_s (seconds) with the vehicle at the pose. As
  /// ping_numbered(), with the numbers 0, 1, 2, ... in turn; a ping that throws takes no number.
  std::span<const EchoLine> ping(const Pose& pose);

  /// One ping of every sonar. Returns one line per sonar, beam and side, in this order: sonars as
  /// in the scene, the beams of a sonar from the rear, and for each beam port before starboard, of
  /// the sides that the sonar has. `number` selects the random numbers: the same number and pose
  /// give the same ping again. The lines are valid until the next call. Throws
  /// std::invalid_argument for a pose that is not finite, lies beyond 1e8 m, turns faster than a
  /// million degrees per second, puts a sonar above the sea surface or below the bed, or moves the
  /// vehicle or a sonar as fast as sound; refine::DamagedFile for a damaged seafloor's file. A ping
  /// over a hole or off the seafloor is allowed; the first one out of reach of the seafloor adds a
  /// warning.
  std::span<const EchoLine> ping_numbered(const Pose& pose, std::uint64_t number);

  /// The lines of the last ping, to keep; the next ping makes new ones. Empty before the first ping
  /// and after they were taken.
  std::vector<EchoLine> take_lines();

  /// Other settings for a sonar of the scene, from the next ping on. Throws SceneError for settings
  /// that a scene's check refuses, MemoryError for rays that do not fit, std::invalid_argument for
  /// a number that no sonar has.
  void set_sonar(std::size_t number, const Sonar& settings);
  /// The same for several sonars, by their numbers: all of them change, or none.
  void set_sonars(std::span<const std::pair<std::size_t, Sonar>> settings);

  /// Adds an object to the scene; y of its mesh points along the heading of the pose. Returns its
  /// instance, the number in the layers: the lowest one that no other object has. altitude_m()
  /// ignores it. Throws std::invalid_argument for an unknown material, a pose that is not finite or
  /// lies beyond 1e8 m, a mesh without faces, or more objects or class names than there are labels;
  /// refine::MeshError for a face whose vertex is not there, not finite or beyond 1e8 m;
  /// MemoryError for a mesh that does not fit; and what the stop_check throws.
  std::uint32_t add(MovingObject object, const Pose& pose);
  /// The instance that the next add() returns.
  std::uint32_t next_instance() const;
  /// Throws std::invalid_argument for an instance that add() did not give, or that is gone, and as
  /// add().
  void move(std::uint32_t instance, const Pose& pose);
  void remove(std::uint32_t instance);

  /// Height over the bed straight below, metres, without objects, negative beneath the bed;
  /// NaN over a hole and off the seafloor.
  double altitude_m(const Eigen::Vector3d& position) const;

  /// The vehicle's pose at each ping of the scene's track over this seafloor. Throws
  /// SceneError.
  std::vector<Pose> track() const;

  const Seafloor& seafloor() const;  ///< valid while this or a clone of it lives
  /// The sonars with their present settings and the bins of their digitisers. Valid until
  /// set_sonar() or add().
  std::span<const Sonar> sonars() const;
  /// The names that the numbers of the class and sediment layers stand for: the seafloor's, then
  /// those that add() added. Valid until the next add().
  std::span<const std::string> classes() const;
  std::span<const std::string> materials() const;
  /// The scene's warnings, repairs of meshes, parameters outside their range, a short cast, a ping
  /// out of reach of the seafloor; valid until the next call. All since the beginning, also those
  /// of settings that set_sonar() has changed since. What lies outside a model's range is in
  /// Extrapolation (extrapolation.h).
  std::span<const std::string> warnings() const;
  double sound_speed_mps() const;  ///< that converts time to range
  /// What a display of the sonar needs; valid until set_sonar() or add(). Throws std::out_of_range
  /// for a number that no sonar has.
  const Calibration& calibration(std::size_t sonar) const;

 private:
  friend struct SimulatorInternals;
  struct SharedState;  // what all threads share; simulator/state.h
  struct ThreadState;  // what one thread owns
  struct Aim;          // where all sonars look at a ping
  struct Entry;        // what each call needs first
  explicit Simulator(std::shared_ptr<const SharedState> shared);
  void aim(const Pose& pose, Aim& aim);
  void warn_of_distance(const Pose& pose);
  void look_ahead(refine::SpareThreads& spare);
  std::shared_ptr<const SharedState> shared_;
  std::unique_ptr<ThreadState> own_;
};

}  // namespace ensonify::engine
