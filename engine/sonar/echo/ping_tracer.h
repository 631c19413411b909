#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include <ensonify/engine/sonar/echo/beam.h>
#include <ensonify/engine/sonar/echo/echo.h>
#include <ensonify/engine/sonar/echo/echo_former.h>
#include <ensonify/engine/sonar/echo/fan_aim.h>
#include <ensonify/engine/sonar/echo/fan_planes.h>
#include <ensonify/engine/sonar/echo/ray_layout.h>
#include <ensonify/engine/sonar/echo/steered_beams.h>
#include <ensonify/engine/sonar/echo/steered_echo.h>
#include <ensonify/engine/trace/fan_tracer.h>
#include <ensonify/engine/trace/traced_faces.h>

namespace ensonify::engine {

/// One sonar on one thread: places the fans of its pings, traces them, and forms the expected echo
/// of each line. It keeps its memory from ping to ping.
class PingTracer {
 public:
  /// The seafloor, the materials and the moving labels must outlive this; all as in EchoFormer.
  /// stop_check is called for each beam, whose tables may take a quarter of a second; it may throw.
  PingTracer(const Sonar& sonar, const Medium& medium, const Seafloor& seafloor,
             std::span<const MaterialInSonar> materials, const Refraction& refraction = {},
             const std::vector<Label>* moving = nullptr, const ObjectSurfaces& surfaces = {},
             const std::function<void()>& stop_check = {});

  /// The lines of a ping, in their order.
  std::span<const LinePlan> lines() const { return lines_; }
  /// The number of a ping's fans.
  std::size_t fans() const { return fans_; }

  /// Places the fans of its sectors for the pose of one of its beams, and the altitude of that over
  /// the bed; and for the range of the nearest bed, if that is less. Appends them to `fans`.
  /// rise_rad: how far above the horizontal the bed reaches, by sector; empty: it does not.
  void aim(const Pose& pose, double altitude_m, double nearest_bed_m,
           std::span<const double> rise_rad, std::vector<FanAim>& fans);
  /// The same over a level bed.
  std::vector<FanAim> aim(const Pose& pose, double altitude_m);

  /// Traces its fans.
  FanTracer& tracer() { return tracer_; }
  const FanTracer& tracer() const { return tracer_; }

  /// Forms the expected echoes of the lines of a fan from what it hit. Sets their sector and beam.
  void echo(std::span<const LinePlan> plans, const FanAim& aim, const FanHits& hits,
            std::span<EchoLine> lines);
  /// What the planes of a fan received, if the sonar's beams are steered; else null. Valid until
  /// the next echo().
  const FanPlanes* planes() const { return steered_ ? &steered_->planes : nullptr; }

 private:
  double nearest_m(const Eigen::Vector3d& from, double nearest_bed_m) const;

  double range_m_;
  double sound_speed_mps_;
  std::span<const Sector> sectors_;
  RayLayouts layouts_;
  ObjectSurfaces surfaces_;
  FanTracer tracer_;
  EchoFormer former_;
  std::vector<Beam> beams_;
  std::vector<LinePlan> lines_;
  std::size_t fans_;
  struct Steered {
    Steered(const Sonar& sonar, const Medium& medium, std::size_t bins);
    SteeredBeams beams;
    SteeredEcho echo;
    FanPlanes planes;
  };
  std::unique_ptr<Steered> steered_;  // null: the beams are parallel
};

}  // namespace ensonify::engine
