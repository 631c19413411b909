#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/face_labels.h>
#include <ensonify/engine/seafloor/objects/buried_surfaces.h>
#include <ensonify/engine/seafloor/objects/object_surface.h>
#include <ensonify/engine/sonar/echo/echo.h>
#include <ensonify/engine/sonar/echo/glint.h>
#include <ensonify/engine/sonar/echo/glint_in_beam.h>
#include <ensonify/engine/sonar/echo/material_in_sonar.h>
#include <ensonify/engine/sonar/echo/medium.h>
#include <ensonify/engine/sonar/echo/object_echo.h>
#include <ensonify/engine/sonar/echo/small_body.h>
#include <ensonify/engine/sonar/echo/surface_walk.h>
#include <ensonify/engine/trace/fan_tracer.h>
#include <ensonify/engine/trace/refraction/ray_incidence.h>
#include <ensonify/scatter/buried_path.h>
#include <ensonify/scatter/sediment.h>

namespace ensonify::engine {

/// The surfaces of the objects that a sonar sees. The data that its pointers refer to must outlive
/// the pings.
struct ObjectSurfaces {
  const std::vector<ObjectSurface>* fixed = nullptr;
  const std::vector<ObjectSurface>* moving = nullptr;  ///< may change between pings
  const std::vector<BuriedGroup>* buried = nullptr;    ///< which the sound reaches through the bed
  /// The height of the bed, as BedGrid::height_m(); none: there is no bed.
  std::function<double(double x_m, double y_m)> bed_height_m = {};
};

/// The echoes of objects that rays cannot sample, from the flat parts of their surfaces.
///
/// Glints: the mirror-like part of a solid's echo, by physical optics (glint.h). Flat parts of one
/// surface at about one range are one glint: facets of a curved one add their energies, pieces of a
/// plane one their fields. Pieces that are an eighth of a pulse apart or more are separate glints,
/// because their pulses overlap less.
///
/// Objects that are shorter than the waves (k times their radius is below 2) return sound as a
/// whole: a smooth one as the rigid ellipsoid with its volume (SmallBody), the parts of a rough one
/// as those of a sphere that is as wide.
///
/// Small objects: those that only a few planes of the fan would meet, however long they are across
/// the track. Their flat parts, in cells no longer than those planes are apart, scatter
/// sigma(grazing) per area each, instead of what rays meet, so that their energy does not depend on
/// where the planes lie.
///
/// Buried things: sound that enters a bed of sediment reaches them along the path of Snell's law
/// (scatter::BuriedPath), and they return
///
///     b_t b_r sigma (1 - |R|^2)^2 exp(-4 k delta / nu s) / J^2,
///
/// with the path s in the sediment and J, the geometric mean of the spreading of both ways. sigma
/// is that of their flat parts, at the angle at which the sound arrives: sigma(grazing) times area,
/// and the glint with the wavelength of the sediment, as if they lay at the range sqrt(J). They
/// appear at the range of their travel time. Left out: that buried things hide one another, and
/// what the bed's roughness lets in below the critical angle.
///
/// Walls: the flat parts within 30 degrees of upright, which mirror the bed before them
/// (OtherPaths), by straight lines.
///
/// Rays decide how much of a flat part is seen: those of the fan next to the ray that leads to it,
/// or for a glint to its cells; of a buried one, next to the ray that leads to the place where its
/// sound enters the bed. Of a place that lies under the bed, only rays that meet the object itself
/// see anything. Where rays are bent, a flat part has the echo of one at the range sqrt(J),
/// in the direction in which the sound arrives; J is here the geometric mean of the ray's spreading
/// on both ways. Sound enters the bed as a straight ray does that arrives there in the same
/// direction with the same spreading.
class ObjectEchoes {
 public:
  /// All that is given must outlive this.
  ObjectEchoes(const Sonar& sonar, const Medium& medium, std::span<const MaterialInSonar> materials,
               const ObjectSurfaces& surfaces);

  /// Finds the echoes of one sector of a ping.
  void find(const SectorView& view, const FanHits& first);
  std::span<const ObjectEcho> glints() const { return glints_; }
  std::span<const ObjectEcho> facets() const { return facets_; }
  std::span<const WallFacet> walls() const { return walls_; }
  /// Whether the object of a label was small in this ping: facets() has its echo.
  bool small(std::uint16_t label) const { return label < small_.size() && small_[label] != 0; }
  bool any_small() const { return !small_labels_.empty(); }

 private:
  static constexpr double max_cells = 256.0;  // of a flat part, in each direction
  struct FanPlace {                           // the direction of a ray, as in FanGrid
    double sin_azimuth, sin_elevation, cos_elevation;
  };
  struct Line {     // from the sonar to a place
    double energy;  // of 1 m^2 of cross-section there, with the medium's mean absorption taken out
    FanPlace in_fan;
  };
  std::optional<RayToPlace> ray_to(const Eigen::Vector3d& away) const;
  std::optional<FanPlace> place_in_fan(const RayToPlace& ray) const;
  bool see(const RayToPlace& ray, Line& line, bool with_arrays = true) const;
  struct RaysAround {  // a direction: these, and the next plane and the next ray
    std::size_t plane, ray;
    double plane_share, ray_share;  // of the next
    double share(std::size_t p, std::size_t j) const {
      return (p ? plane_share : 1.0 - plane_share) * (j ? ray_share : 1.0 - ray_share);
    }
  };
  RaysAround rays_around(const FanPlace& place) const;
  struct OwnPlace {  // of an object
    const Eigen::Vector3d& away;
    std::uint16_t label;
    /// A hit with the same label that is nearer by less than this does not hide the place.
    double own_m = 0.0;
  };
  double seen_share(const FanPlace& place, double time_range_m, const OwnPlace* own) const;
  double apart_m(const FanPlace& place, double time_range_m) const;
  bool is_covered(const Eigen::Vector3d& away) const;
  bool is_other(int label, const OwnPlace& own) const;
  double rounding_m(const Eigen::Vector3d& away) const;
  struct Sight {  // of a place
    double range_m;
    double seen;    // share of the sound that reaches it
    double energy;  // of 1 m^2 of cross-section there, if all of it is seen
  };
  std::optional<Sight> sight_of(const Eigen::Vector3d& place, const OwnPlace& shows_seen,
                                bool with_arrays = true) const;
  std::optional<double> seen_through(const FlatPart& flat_part, const OwnPlace& middle,
                                     const Eigen::Vector3d& off) const;
  std::optional<SeenCells> look_at_cells(const FlatPart& flat_part, const OwnPlace& middle,
                                         const FlatPartInBeam& in_beam, std::size_t count) const;
  std::optional<SeenLine> look_at_line(const MirrorLine& line, const OwnPlace& middle,
                                       const BeamOnLine& in_beam, std::size_t count) const;
  GlintBeam glint_beam() const;
  struct FirstHit {  // of a ray
    double range_m = std::numeric_limits<double>::infinity();
    int label = -1;
  };
  std::array<FirstHit, 2> first_hits(std::size_t plane, std::size_t ray) const;
  bool is_nearer(const FirstHit& hit, double range_m, const OwnPlace& own) const;
  bool is_own(const FirstHit& hit, const OwnPlace& own) const;
  static bool is_short(const ObjectSurface& object, const Eigen::Vector3d& axis, double length_m);
  double widest_step_rad(const ObjectSurface& object) const;
  void look_at(const ObjectSurface& object);
  void add_small_body(const SmallBody& body, double specular, const ObjectSurface& object);
  void add_glint(const FlatPart& flat_part, const Eigen::Vector3d& away,
                 const Eigen::Vector3d& apparent, double specular, const ObjectSurface& object);
  void add_glint_at(const Eigen::Vector3d& place, double range_m, double energy,
                    std::uint16_t label, std::uint32_t surface);
  void add_mirror_at(const Eigen::Vector3d& place, double range_m, double energy_per_m2,
                     std::uint16_t label, const FlatPart& flat_part, const Mirror& mirror);
  void add_corner(const RightCorner& corner, double specular, const ObjectSurface& object);
  void add_facets(const FlatPart& flat_part, const Eigen::Vector3d& away,
                  const ObjectSurface& object, double small_m, double gain);
  bool may_see(const Eigen::Vector3d& middle, double radius_m) const;
  bool may_be_in_beam(const Eigen::Vector3d& middle, double radius_m) const;
  struct BuriedWay {  // to a place in the bed, from the sonar
    scatter::BuriedPath path;
    const scatter::Sediment* sediment;
    RayToPlace ray;           // to where it enters the bed
    Eigen::Vector3d arrival;  // unit, of travel in the sediment
  };
  std::optional<BuriedWay> way_into_bed(const Eigen::Vector3d& away, double depth_m,
                                        const BuriedPart& part) const;
  struct BuriedSight {
    double time_range_m = 0.0, energy = 0.0;  // energy: of 1 m^2 of cross-section
  };
  BuriedSight see_buried(const BuriedWay& way) const;
  void find_walls(const ObjectSurface& object);
  void add_wall(const FlatPart& flat_part, const WallMirror& mirror, std::uint16_t its_label);
  void look_into_bed(const BuriedGroup& group);
  void add_buried_facets(const BuriedPart& part, const BuriedGroup& group, const Label& label);
  void add_buried_glint(const BuriedPart& part, const BuriedGroup& group, double specular);
  void join_glints();

  double wavelength_m_, join_m_, join_pieces_m_, tolerance_m_;
  Medium medium_;
  std::span<const MaterialInSonar> materials_;
  ObjectSurfaces surfaces_;
  std::vector<ObjectEcho> glints_, facets_;
  std::vector<WallFacet> walls_;
  std::vector<std::uint8_t> small_;  // by label
  std::vector<std::uint16_t> small_labels_;

  // Of the sector that is computed:
  const SectorView* view_ = nullptr;
  const FaceLabels* labels_ = nullptr;
  FanHits first_;
};

}  // namespace ensonify::engine
