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

// The libraries are static and promise no binary interface: build a program with the headers of the
// library that it is linked with.

namespace ensonify::refine {
class SpareThreads;
}

namespace ensonify::engine {

struct Calibration;         // image/display.h
struct Scene;               // scene/scene.h; scene/reader.h reads one
struct Seafloor;            // seafloor/seafloor.h
struct SimulatorInternals;  // simulator/internals.h

/// A scene that is ready: its seafloor is made, and pings can be made from any pose.
///
/// Not thread-safe: only one thread at a time may use a Simulator. Different Simulators may run at
/// the same time, also if they share a seafloor. clone_for_thread() returns a Simulator that shares
/// the seafloor; it has the scene's original settings and no added objects. A ping depends only on
/// the scene, on what was changed since, on the pose and on the ping's number. An exception is
/// thrown before anything is changed. Only an exception of the stop_check may come later; then the
/// lines are not complete. The child of a fork() may use the Simulators of its parent. If a thread
/// was in a call of one of several Simulators that share a seafloor, all of these throw
/// std::runtime_error in the child. The caller's rounding mode, flush-to-zero flags and
/// floating-point traps have no effect, and are not changed.
class Simulator {
 public:
  /// Throws SceneError, refine::MeshError, MemoryError, std::invalid_argument.
  explicit Simulator(const Scene& scene, const Preparation& how = {});
  Simulator(Simulator&&) noexcept;
  Simulator& operator=(Simulator&&) noexcept;
  ~Simulator();
  /// A Simulator for another thread, see above. Throws std::bad_alloc.
  Simulator clone_for_thread() const;

  /// The next ping of the session, sent at pose.t_s (seconds) with the vehicle at the pose. It is a
  /// ping_numbered() with the number 0, 1, 2, ...; a ping that throws takes no number.
  std::span<const EchoLine> ping(const Pose& pose);

  /// One ping of every sonar. Returns one line per sonar, beam and side. The sonars are in the
  /// scene's order; the beams of a sonar begin at the rear; the lines of a beam are port before
  /// starboard, of the sides that the sonar has. `number` selects the random numbers: the same
  /// number and pose give the same ping again. The lines are valid until the next call. Throws
  /// std::invalid_argument for a pose that is not finite, lies beyond 1e8 m, turns faster than a
  /// million degrees per second, puts a sonar above the sea surface or below the bed, or moves the
  /// vehicle or a sonar as fast as sound; refine::DamagedFile for a damaged file of the seafloor. A
  /// ping over a hole or outside the seafloor is allowed; the first ping out of reach of the
  /// seafloor adds a warning.
  std::span<const EchoLine> ping_numbered(const Pose& pose, std::uint64_t number);

  /// Moves the lines of the last ping to the caller, who keeps them; the next ping makes new lines.
  /// Empty before the first ping, and if the lines were taken before.
  std::vector<EchoLine> take_lines();

  /// Changes the settings of one sonar of the scene, from the next ping on. Throws SceneError for
  /// settings that the check of a scene refuses, MemoryError for rays that do not fit,
  /// std::invalid_argument for a number that no sonar has.
  void set_sonar(std::size_t number, const Sonar& settings);
  /// Changes the settings of several sonars, by their numbers: all of them are changed, or none.
  void set_sonars(std::span<const std::pair<std::size_t, Sonar>> settings);

  /// Adds an object to the scene; y of its mesh points along the heading of the pose. Returns the
  /// object's instance, its number in the layers: the lowest number that no other object has.
  /// altitude_m() ignores the object. Throws std::invalid_argument for an unknown material, a pose
  /// that is not finite or lies beyond 1e8 m, a mesh without faces, or more objects or class names
  /// than there are labels; refine::MeshError for a face with a vertex that does not exist, is not
  /// finite or lies beyond 1e8 m; MemoryError for a mesh that does not fit; what stop_check throws.
  std::uint32_t add(MovingObject object, const Pose& pose);
  /// The instance that the next add() returns.
  std::uint32_t next_instance() const;
  /// Both throw std::invalid_argument for an instance that add() did not return or that was
  /// removed. move() also throws it for a pose that add() refuses.
  void move(std::uint32_t instance, const Pose& pose);
  void remove(std::uint32_t instance);

  /// The height of a position over the bed straight below, in metres, without objects. Negative
  /// below the bed; NaN over a hole and outside the seafloor.
  double altitude_m(const Eigen::Vector3d& position) const;

  /// The vehicle's pose at each ping of the scene's track over the seafloor. Throws SceneError.
  std::vector<Pose> track() const;

  const Seafloor& seafloor() const;  ///< valid while this Simulator or a clone of it exists
  /// The sonars with their present settings; their bins are those of their digitisers. Valid until
  /// set_sonar() or add().
  std::span<const Sonar> sonars() const;
  /// The names for the numbers in the class and sediment layers: first those of the seafloor, then
  /// those that add() added. Valid until the next add().
  std::span<const std::string> classes() const;
  std::span<const std::string> materials() const;
  /// All warnings since the beginning: the scene's warnings, repairs of meshes, parameters outside
  /// their range, a short cast, a ping out of reach of the seafloor. Warnings of settings stay
  /// after set_sonar() has changed these. Valid until the next call. What lies outside a model's
  /// range is in Extrapolation (extrapolation.h).
  std::span<const std::string> warnings() const;
  double sound_speed_mps() const;  ///< the speed that converts travel times to ranges
  /// What a display of the sonar needs. Valid until set_sonar() or add(). Throws std::out_of_range
  /// for a number that no sonar has.
  const Calibration& calibration(std::size_t sonar) const;

 private:
  friend struct SimulatorInternals;
  struct SharedState;  // what all threads share (simulator/state.h)
  struct ThreadState;  // what one thread owns
  struct Aim;          // the fans of all sonars at a ping
  struct Entry;        // is made at the beginning of each call
  explicit Simulator(std::shared_ptr<const SharedState> shared);
  void aim(const Pose& pose, Aim& aim);
  void warn_of_distance(const Pose& pose);
  void look_ahead(refine::SpareThreads& spare);
  std::shared_ptr<const SharedState> shared_;
  std::unique_ptr<ThreadState> own_;
};

}  // namespace ensonify::engine
