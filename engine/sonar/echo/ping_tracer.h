#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include <ensonify/engine/sonar/echo/echo_former.h>
#include <ensonify/engine/sonar/echo/steered_beams.h>
#include <ensonify/engine/sonar/echo/steered_echo.h>

namespace ensonify::engine {

/// One sonar on one thread: places the fans of its pings, traces them, and forms the expected echo
/// of each line. It keeps its memory from ping to ping.
class PingTracer {
 public:
  /// The seafloor, the materials and the moving labels must outlive this; all as in EchoFormer.
  /// stop_check is called for each beam, because its tables may take a quarter of a second; it may
  /// throw.
  PingTracer(const Sonar& sonar, const Medium& medium, const Seafloor& seafloor,
             std::span<const MaterialInSonar> materials, const Refraction& refraction = {},
             const std::vector<Label>* moving = nullptr, const ObjectSurfaces& surfaces = {},
             const std::function<void()>& stop_check = {});

  /// The lines of a ping, in their order.
  std::span<const LinePlan> lines() const { return lines_; }
  /// The number of a ping's fans.
  std::size_t fans() const { return fans_; }

  /// Places the fans of all sectors of one beam, and appends them to `fans`. pose, altitude_m: of
  /// the beam, over the bed straight below. nearest_bed_m: range of the nearest bed, if less than
  /// the altitude. rise_rad: by sector, how far above the horizontal the bed reaches; empty: it
  /// does not.
  void aim(const Pose& pose, double altitude_m, double nearest_bed_m,
           std::span<const double> rise_rad, std::vector<FanAim>& fans);
  /// The same over a level bed.
  std::vector<FanAim> aim(const Pose& pose, double altitude_m);

  /// Traces the fans.
  FanTracer& tracer() { return tracer_; }
  const FanTracer& tracer() const { return tracer_; }

  /// Forms the expected echoes of the lines of a fan from what it hit. Sets their sector and beam.
  void echo(std::span<const LinePlan> plans, const FanAim& aim, const FanHits& hits,
            std::span<EchoLine> lines);
  /// What the planes of a fan received, if the sonar's beams are steered; else null. Valid until
  /// the next echo().
  const FanPlanes* planes() const { return steered_ ? &steered_->planes : nullptr; }

 private:
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
    Steered(const Sonar& sonar, const Medium& medium, std::size_t bins,
            const std::function<void()>& stop_check);
    SteeredBeams beams;
    SteeredEcho echo;
    FanPlanes planes;
  };
  std::unique_ptr<Steered> steered_;  // null: the beams are parallel
};

}  // namespace ensonify::engine
