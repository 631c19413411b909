#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/prepare.h>
#include <ensonify/engine/scene/flight.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/sonar/echo.h>
#include <ensonify/engine/sonar/track.h>
#include <ensonify/engine/trace/ray_fan.h>

namespace ensonify::engine {

/// Seconds spent in a ping's stages, summed over pings.
struct StageTimes {
  double surface_s = 0.0;  ///< which triangles are there
  double trace_s = 0.0;    ///< nearest hits
  double echo_s = 0.0;     ///< scattering and binning
  double speckle_s = 0.0;
  StageTimes& operator+=(const StageTimes& other);
};

/// A scene made ready: the seafloor is there and its surface built. The whole pipeline on one page.
///
/// One thread at a time may use a Simulator; another() makes one more over the same seafloor, for a
/// further thread. A ping depends on nothing but the scene, the pose and the number.
class Simulator {
 public:
  /// Throws SceneError, refine::MeshError, std::invalid_argument.
  explicit Simulator(const Scene& scene, const Preparation& how = {});
  Simulator(Simulator&&) noexcept;
  Simulator& operator=(Simulator&&) noexcept;
  ~Simulator();
  Simulator another() const;

  /// One ping of every sonar, the vehicle being at a pose: the sides of the first (port, then
  /// starboard, of those it has), then of the next. `number` tells pings apart in their random
  /// numbers. The lines are good until the next call. Throws
  /// std::invalid_argument for a pose that is not finite, refine::DamagedFile where an analysed
  /// seafloor's file turns out to be damaged.
  std::span<const EchoLine> ping(const Pose& pose, std::uint64_t number);

  /// The fans of a ping, in the order of its lines; good until the next call. Throws as ping().
  std::span<const RayFan> aim(const Pose& pose);

  /// Forgets what earlier pings left in the surface. Pings do not depend on it; a block of them starts
  /// with it, so that memory and speed do not either.
  void reset();

  /// Height over the bed straight below, objects looked through, negative beneath it; NaN over a hole
  /// and off the seafloor.
  double altitude_m(const Eigen::Vector3d& position) const;

  /// The scene's track over this seafloor, the vehicle's pose at each ping. Throws SceneError.
  Flight flight() const;
  std::vector<Pose> track() const;  ///< its poses alone

  const Seafloor& seafloor() const;
  /// How the seafloor came to be.
  const PreparedSeafloor& prepared() const;
  /// The scene's, with the bins of their digitisers.
  std::span<const Sonar> sonars() const;
  /// What should be said once a run: repairs, models outside their range, a cast that is too short.
  std::span<const std::string> warnings() const;
  /// What the intersector's last bits depend on.
  std::string_view code_path() const;
  double absorption_db_per_m(std::size_t sonar) const;
  double sound_speed_mps() const;  ///< that ranges are counted by
  const StageTimes& times() const;

 private:
  struct Ready;   // what all threads share
  struct Worker;  // one thread's own
  explicit Simulator(std::shared_ptr<const Ready> ready);
  double bed_height_m(double x_m, double y_m) const;
  std::shared_ptr<const Ready> ready_;
  std::unique_ptr<Worker> worker_;
};

}  // namespace ensonify::engine
