#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/objects/buried_surfaces.h>
#include <ensonify/engine/sonar/echo/object_sight.h>
#include <ensonify/engine/sonar/echo/small_body.h>

namespace ensonify::engine {

/// The surfaces of the objects that a sonar sees. The data behind the pointers must outlive the
/// pings.
struct ObjectSurfaces {
  const std::vector<ObjectSurface>* fixed = nullptr;
  const std::vector<ObjectSurface>* moving = nullptr;  ///< may change between pings
  const std::vector<BuriedGroup>* buried = nullptr;    ///< that the sound reaches through the bed
  /// The height of the bed, as BedGrid::height_m(); empty: there is no bed.
  std::function<double(double x_m, double y_m)> bed_height_m = {};
};

/// The echoes of objects that rays cannot sample, from the flat parts of their surfaces: glints
/// (glint.h), objects that are shorter than the waves (SmallBody), small objects, which only a few
/// planes of the fan would meet, and things in the bed (BuriedEchoes). engine/sonar/README.md has a
/// section on each. ObjectSight finds how much of a flat part is seen.
///
/// Flat parts of one surface at about one range are one glint: the facets of a curved surface add
/// their energies, the pieces of a plane surface add their fields. Pieces that are an eighth of a
/// pulse apart or more are separate glints, because their pulses overlap less.
///
/// Walls are the flat parts within 30 degrees of upright. They mirror the bed in front of them
/// (OtherPaths), which is computed along straight lines.
///
/// For bent rays, a flat part has the echo of a flat part at the range sqrt(J), in the direction in
/// which the sound arrives. Here J is the geometric mean of the ray's spreading on the way out and
/// on the way back.
class ObjectEchoes {
 public:
  /// All arguments must outlive this.
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
  /// The sine, from the array's broadside, of the direction from which an echo's sound arrives. (A
  /// bent ray comes back the way on which it went out.)
  double arrival_sine(const ObjectEcho& echo) const;

 private:
  static bool is_short(const ObjectSurface& object, const Eigen::Vector3d& axis, double length_m);
  double widest_step_rad(const ObjectSurface& object) const;
  void look_at(const ObjectSurface& object);
  void add_small_body(const SmallBody& body, double specular, const ObjectSurface& object);
  void add_glint(const FlatPart& flat_part, const Eigen::Vector3d& away,
                 const Eigen::Vector3d& apparent, double specular, const ObjectSurface& object);
  void add_corner(const RightCorner& corner, double specular, const ObjectSurface& object);
  void add_facets(const FlatPart& flat_part, const Eigen::Vector3d& away,
                  const ObjectSurface& object, double small_m, double gain);
  void find_walls(const ObjectSurface& object);
  void add_wall(const FlatPart& flat_part, const WallMirror& mirror, std::uint16_t its_label);
  void join_glints();

  double wavelength_m_, join_m_, join_pieces_m_;
  std::span<const MaterialInSonar> materials_;
  ObjectSurfaces surfaces_;
  ObjectSight sight_;
  std::vector<ObjectEcho> glints_, facets_;
  std::vector<WallFacet> walls_;
  std::vector<std::uint8_t> small_;  // by label
  std::vector<std::uint16_t> small_labels_;
};

}  // namespace ensonify::engine
