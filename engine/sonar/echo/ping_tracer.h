#pragma once

#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <ensonify/engine/sonar/echo/echo.h>
#include <ensonify/engine/sonar/echo/echo_former.h>
#include <ensonify/engine/sonar/echo/ray_layout.h>
#include <ensonify/engine/trace/intersector.h>
#include <ensonify/engine/trace/refraction/refracted_tracer.h>
#include <ensonify/engine/trace/refraction/refraction_mode.h>
#include <ensonify/engine/trace/refraction/travel_time.h>

namespace ensonify::engine {

/// The layered sea of all pings, for rays that are not straight.
struct Refraction {
  RefractionMode mode = RefractionMode::off;
  const scatter::SoundSpeedProfile* profile = nullptr;
  double highest_m = 0.0;  ///< height of the highest face
  double deepest_m = 0.0;  ///< depth of the deepest
  bool lists = true;       ///< the intersectors answer lists of rays
};

/// Where the sectors of one beam look at a ping.
struct BeamAim {
  double altitude_m = 0.0;  ///< over the bed
  // By sector:
  std::array<RayFan, most_sectors> fans;
  std::array<std::shared_ptr<const RayLayout>, most_sectors> layouts;
  std::array<ReceiverMotion, most_sectors> motions;
};

/// One beam of a sonar on one thread: places its fans, traces them, and forms the expected echo. It
/// keeps its memory from ping to ping.
class PingTracer {
 public:
  /// The seafloor, the tables and the moving labels must outlive this; all as in EchoFormer. The
  /// number of the beam is that of its lines.
  PingTracer(const Sonar& sonar, const Medium& medium, const Seafloor& seafloor,
             std::span<const scatter::BackscatterTable> material_tables,
             const Refraction& refraction = {}, const std::vector<Label>* moving = nullptr,
             const ObjectSurfaces& surfaces = {}, int beam = 0);

  /// Places the fans of its sectors for the sonar's own pose, at the beam's offset along the array,
  /// and its altitude over the bed; and for the range of the nearest bed, if that is less.
  /// rise_rad: how far above the horizontal the bed reaches, by sector; 0 if not.
  BeamAim aim(const Pose& pose, double altitude_m,
              double nearest_bed_m = std::numeric_limits<double>::infinity(),
              const std::array<double, most_sectors>& rise_rad = {});

  /// Whether its rays bend or have other travel times, so that trace() needs hits, not runs.
  bool needs_hits() const { return refracted_ || travel_time_; }

  /// Whether its rays bend.
  bool bends() const { return refracted_.has_value(); }

  /// Finds what the fan of a sector hits. The aim and the faces must stay unchanged until echo()
  /// and runs() of this sector were called. Returns false if it needs the faces of a bed that is
  /// given as a grid.
  [[nodiscard]] bool trace(const BeamAim& aim, const TracedFaces& faces, std::size_t sector);
  /// What the runs and hits of the sector that was traced last index.
  refine::Triangles triangles() const { return refracted_ ? refracted_->triangles() : triangles_; }
  /// The runs of the sector that was traced last; valid until the next call. Not for bent rays.
  const FanRuns& runs(const BeamAim& aim, std::size_t sector);
  /// Forms the expected echo of the sector that was traced last. Sets the sector and the beam of
  /// the line.
  void echo(const BeamAim& aim, std::size_t sector, EchoLine& line);
  /// Counts of how its refracted rays were decided, since it was made.
  RefractionCounts refraction_counts() const {
    return refracted_ ? refracted_->counts() : RefractionCounts{};
  }

 private:
  double nearest_m(const Eigen::Vector3d& from, double nearest_bed_m) const;

  int beam_;
  double range_m_;
  double sound_speed_mps_;
  std::span<const Sector> sectors_;
  RayLayouts layouts_;
  ObjectSurfaces surfaces_;
  EchoFormer former_;
  FanBend bend_;
  std::optional<RefractedTracer> refracted_;  // at most one of the two
  std::optional<TravelTime> travel_time_;
  refine::Triangles triangles_;
  FanRuns runs_;  // of straight rays
  std::vector<Hit> hits_;
};

}  // namespace ensonify::engine
