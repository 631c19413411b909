#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/face_labels.h>
#include <ensonify/engine/seafloor/objects/buried_surfaces.h>
#include <ensonify/engine/seafloor/objects/patches.h>
#include <ensonify/engine/sonar/echo/echo.h>
#include <ensonify/engine/sonar/echo/medium.h>
#include <ensonify/engine/sonar/echo/object_echo.h>
#include <ensonify/engine/sonar/echo/surface_walk.h>
#include <ensonify/engine/trace/fan_runs.h>
#include <ensonify/engine/trace/ray.h>
#include <ensonify/engine/trace/refraction/ray_incidence.h>
#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/buried_path.h>
#include <ensonify/scatter/sediment.h>

namespace ensonify::engine {

/// How a wall of a material reflects: shares of the energy that arrives.
struct WallMirror {
  double smooth = 0.0;  ///< as a smooth surface would
  double rough = 0.0;   ///< from facets that are inclined to the surface
  double slope = 0.0;   ///< rms of that inclination in one direction, as a tangent
};

/// The surfaces of the objects that a sonar sees. What it points to must outlive the pings.
struct ObjectSurfaces {
  const std::vector<PatchedObject>* fixed = nullptr;
  const std::vector<PatchedObject>* moving = nullptr;  ///< may change between pings
  /// By Label::sediment: scatter::Solid::smooth_specular(), 0 where it is not a solid.
  std::span<const double> smooth_specular = {};
  const std::vector<BuriedGroup>* buried = nullptr;  ///< into which the sound penetrates
  /// By Label::sediment; none where it is not a sediment.
  std::span<const std::optional<scatter::Sediment>> sediments = {};
  /// By Label::sediment; empty: walls are not looked for.
  std::span<const WallMirror> mirrors = {};
};

/// What the rays of a fan met first: straight ones as runs, others as hits.
struct FirstHits {
  const FanRuns* runs = nullptr;  ///< or else:
  std::span<const Hit> hits = {};
  const IncidenceSource* rays = nullptr;  ///< knows the rays that are not straight and even
};

/// The echoes of objects that rays cannot sample, from the patches of their surfaces.
///
/// Glints: the mirror-like part of a solid's echo. By physical optics a patch L1 x L2 that lies at
/// the range r, whose normal is inclined by t_i to the sonar in the direction of L_i, has the
/// cross-section
///
///     I_1 I_2 / lambda^2,  I = |integral over L of exp(i k (z - r t)^2 / r) dz|^2,
///
/// with Fresnel's integral (Abramowitz and Stegun, ch. 7): far away I = L^2 sinc^2(2 L t / lambda),
/// which gives a plate its A^2 / lambda^2; near it I = lambda r / 2, which gives a mirror its
/// r^2 / 4. Of a round patch the integral is over its disc: far away (A / lambda 2 J1(x) / x)^2,
/// x = 4 pi a t / lambda. Where facets stand for a curved surface, they share its energy: there
///
///     I = (lambda r / 4) (erf((t + h) / s) - erf((t - h) / s)),  h = L / 2 r,
///
/// a lobe of the same energy whose half width s is the angle between neighbouring facets, so that
/// facets sum to the round body: a^2 / 4 for a sphere; a L^2 / (2 lambda) for a cylinder far away,
/// a r / 4 near it. (Urick's a r / 2 is that of plane waves; those of a sonar are curved by 1 / r.)
/// Patches of one surface at about one range are one glint.
///
/// Two plane patches in a right angle send sound back to where it came from, by way of both. Seen
/// in the plane across their edge, at the angles g_i to the patches, which reach w_i from it, that
/// is a mirror of the width W = 2 min(w_1 sin g_1, w_2 sin g_2) that faces the sonar; along the
/// edge it is a patch. So far away it has
///
///     sigma = W^2 L^2 / lambda^2,
///
/// 2 a^2 L^2 / lambda^2 for two equal patches seen from the middle (Ruck, Radar Cross Section
/// Handbook, 1970, ch. 8: 8 pi a^2 L^2 / lambda^2 over 4 pi). An angle that is d over a right one
/// turns what returns by 2 d: I = |2 integral from 0 to W / 2 of exp(i k (z + r d)^2 / r) dz|^2.
/// Both reflections lose.
///
/// Small objects: those that only a few planes of the fan would meet, however long they are across
/// the track. Their patches, in cells no longer than those planes are apart, scatter
/// sigma(grazing) per area each, instead of what rays meet, so that their energy does not depend on
/// where the planes lie.
///
/// Buried things: sound that enters a bed of sediment reaches them along the path of Snell's law
/// (scatter::BuriedPath), and they return
///
///     b_t b_r sigma (1 - |R|^2)^2 exp(-4 k delta / nu s) / J^2,
///
/// with the path s in the sediment and J, the geometric mean of the spreading of both ways. sigma
/// is that of their patches, at the angle at which the sound arrives: sigma(grazing) times area,
/// and the glint with the wavelength of the sediment, as if they lay at the range sqrt(J). They
/// appear at the range of their travel time. Left out: that buried things hide one another, and
/// what the bed's roughness lets in below the critical angle.
///
/// Walls: the plane patches within 30 degrees of upright, which mirror the bed before them
/// (OtherPaths), by straight lines.
///
/// Rays decide how much of a patch is seen: those of the fan next to the ray that leads to it; of a
/// buried one, next to the ray that leads to the place where its sound enters the bed. Where rays
/// are bent, a patch has the echo of one at the range sqrt(J), in the direction in which the sound
/// arrives; J is here the geometric mean of the ray's spreading on both ways. Only where the sound
/// enters the bed follows from straight lines in the water.
class ObjectEchoes {
 public:
  /// All that is given must outlive this.
  ObjectEchoes(const Sonar& sonar, const Medium& medium,
               std::span<const scatter::BackscatterTable> material_tables,
               const ObjectSurfaces& surfaces);

  /// Finds the echoes of one side of a ping.
  void find(const SideView& view, const FaceLabels& labels, const FirstHits& first);
  std::span<const ObjectEcho> glints() const { return glints_; }
  std::span<const ObjectEcho> facets() const { return facets_; }
  std::span<const WallFacet> walls() const { return walls_; }
  /// Whether the object of a label was small in this ping: facets() has its echo.
  bool small(std::uint16_t label) const { return label < small_.size() && small_[label] != 0; }
  bool any_small() const { return !small_labels_.empty(); }

 private:
  struct Line {     // from the sonar to a place
    double energy;  // of 1 m^2 of cross-section there, with the medium's mean absorption taken out
    double sin_azimuth, sin_elevation;
  };
  std::optional<RayToPlace> ray_to(const Eigen::Vector3d& away) const;
  bool see(const RayToPlace& ray, Line& line) const;
  double seen_share(const Line& line, double time_range_m, int own_label = -1,
                    double own_m = 0.0) const;
  struct FirstHit {  // of a ray
    double range_m = std::numeric_limits<double>::infinity();
    int label = -1;
  };
  std::array<FirstHit, 2> first_hits(std::size_t plane, std::size_t ray) const;
  static bool is_short(const PatchedObject& object, const Eigen::Vector3d& axis, double length_m);
  double widest_step_rad(const PatchedObject& object) const;
  void look_at(const PatchedObject& object);
  void add_glint(const FlatPart& patch, const Eigen::Vector3d& away,
                 const Eigen::Vector3d& apparent, double specular, const PatchedObject& object);
  void add_corner(const RightCorner& corner, double specular, const PatchedObject& object);
  void add_facets(const FlatPart& patch, const Eigen::Vector3d& away, const PatchedObject& object,
                  double small_m);
  bool may_see(const Eigen::Vector3d& middle, double radius_m) const;
  bool may_be_in_beam(const Eigen::Vector3d& middle, double radius_m) const;
  struct BuriedWay {  // to a place in the bed, from the sonar
    scatter::BuriedPath path;
    const scatter::Sediment* sediment;
    Eigen::Vector3d enters, arrival;  // where it enters the bed; unit, of travel in the sediment
  };
  std::optional<BuriedWay> way_into_bed(const Eigen::Vector3d& away, double depth_m,
                                        const BuriedPart& part) const;
  struct BuriedSight {
    double time_range_m = 0.0, energy = 0.0;  // energy: of 1 m^2 of cross-section
  };
  BuriedSight see_buried(const BuriedWay& way, bool near_is_counted) const;
  void find_walls(const PatchedObject& object);
  void add_wall(const FlatPart& patch, const WallMirror& mirror, bool two_sided);
  void look_into_bed(const BuriedGroup& group);
  void add_buried_facets(const BuriedPart& part, const BuriedGroup& group, const Label& label);
  void add_buried_glint(const BuriedPart& part, const BuriedGroup& group, double specular);
  void join_glints();

  double wavelength_m_, join_m_, tolerance_m_;
  Medium medium_;
  std::span<const scatter::BackscatterTable> by_material_;
  ObjectSurfaces surfaces_;
  std::vector<ObjectEcho> glints_, facets_;
  std::vector<WallFacet> walls_;
  std::vector<std::uint8_t> small_;  // by label
  std::vector<std::uint16_t> small_labels_;

  // Of the side at hand:
  const SideView* view_ = nullptr;
  const FaceLabels* labels_ = nullptr;
  FirstHits first_;
};

}  // namespace ensonify::engine
