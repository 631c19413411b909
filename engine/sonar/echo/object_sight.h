#pragma once

#include <functional>
#include <limits>
#include <optional>

#include <Eigen/Core>

#include <ensonify/engine/sonar/echo/glint_in_beam.h>
#include <ensonify/engine/sonar/echo/media_in_sonar.h>
#include <ensonify/engine/sonar/echo/surface_walk.h>
#include <ensonify/engine/trace/fan_tracer.h>
#include <ensonify/engine/trace/refraction/ray_incidence.h>

namespace ensonify::engine {

/// What a fan sees of places on objects: the rays that lead there, and how much of the sound
/// arrives. The fan's rays next to the ray to a place decide how much of the place is seen. A place
/// under the bed is seen only by rays that meet the object itself.
class ObjectSight {
 public:
  /// bed_height_m: as BedGrid::height_m(); empty: there is no bed.
  ObjectSight(const Medium& medium, double wavelength_m, double bin_m,
              std::function<double(double x_m, double y_m)> bed_height_m);

  /// Sets the sector for the calls that follow. first: what its rays hit first. Both must outlive
  /// these calls.
  void look(const SectorView& view, const FanHits& first);
  const RayFan& fan() const { return *view_->fan; }
  const FaceLabels& labels() const { return *view_->labels; }
  bool bent() const { return first_.incidences != nullptr; }

  struct FanPlace {  // the direction of a ray, as in FanGrid
    double sin_azimuth, sin_elevation, cos_elevation;
  };
  struct Line {     // from the sonar to a place
    double energy;  // of 1 m^2 of cross-section there, without the medium's mean absorption
    FanPlace in_fan;
  };
  struct OwnPlace {  // of an object
    const Eigen::Vector3d& away;
    std::uint16_t label;
    /// A hit with the same label that is nearer by less than this does not hide the place.
    double own_m = 0.0;
  };
  struct Sight {  // of a place
    double range_m;
    double seen;    // share of the sound that reaches it
    double energy;  // of 1 m^2 of cross-section there, if all of it is seen
  };

  std::optional<RayToPlace> ray_to(const Eigen::Vector3d& away) const;
  bool see(const RayToPlace& ray, Line& line, bool with_arrays = true) const;
  double seen_share(const FanPlace& place, double time_range_m, const OwnPlace* own) const;
  double apart_m(const FanPlace& place, double time_range_m) const;
  std::optional<Sight> sight_of(const Eigen::Vector3d& place, const OwnPlace& shows_seen,
                                bool with_arrays = true) const;
  std::optional<SeenCells> look_at_cells(const FlatPart& flat_part, const OwnPlace& middle,
                                         const FlatPartInBeam& in_beam, std::size_t count) const;
  std::optional<SeenCells> look_at_line(const MirrorLine& line, const OwnPlace& middle,
                                        const BeamOnLine& in_beam, std::size_t count) const;
  GlintBeam glint_beam() const;
  bool may_see(const Eigen::Vector3d& middle, double radius_m) const;
  bool may_be_in_beam(const Eigen::Vector3d& middle, double radius_m) const;

 private:
  struct RaysAround {  // around a direction: these, the next plane and the next ray
    std::size_t plane, ray;
    double plane_share, ray_share;  // weights of the next plane and ray
    double share(std::size_t p, std::size_t j) const {
      return (p ? plane_share : 1.0 - plane_share) * (j ? ray_share : 1.0 - ray_share);
    }
  };
  struct FirstHit {  // of a ray
    double range_m = std::numeric_limits<double>::infinity();
    int label = -1;
  };
  std::optional<FanPlace> place_in_fan(const RayToPlace& ray) const;
  RaysAround rays_around(const FanPlace& place) const;
  std::array<FirstHit, 2> first_hits(std::size_t plane, std::size_t ray) const;
  bool is_covered(const Eigen::Vector3d& away) const;
  bool is_other(int label, const OwnPlace& own) const;
  bool is_nearer(const FirstHit& hit, double range_m, const OwnPlace& own) const;
  bool is_own(const FirstHit& hit, const OwnPlace& own) const;
  double rounding_m(const Eigen::Vector3d& away) const;
  std::optional<double> seen_through(const FlatPart& flat_part, const OwnPlace& middle,
                                     const Eigen::Vector3d& off) const;

  Medium medium_;
  double wavelength_m_, tolerance_m_;
  std::function<double(double x_m, double y_m)> bed_height_m_;
  const SectorView* view_ = nullptr;
  FanHits first_;
};

}  // namespace ensonify::engine
