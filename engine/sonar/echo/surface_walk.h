#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/sonar/echo/piece_table.h>
#include <ensonify/engine/sonar/echo/range_bins.h>
#include <ensonify/engine/sonar/echo/ray_layout.h>

namespace ensonify::engine {

/// The data of one sector of one ping from which its echo is formed. What the members point to must
/// outlive this.
struct SectorView {
  std::size_t sector;  ///< its place in Sonar::sectors()
  const Beam* beam;
  const RayFan* fan;
  const RayLayout* layout;  ///< the fan's
  const ReceiverMotion* motion;
  refine::Triangles triangles;
  const FaceLabels* labels;
};

/// Walks over the pieces of a plane in the order of elevation, from the lowest ray upwards, and
/// decides where one surface continues from piece to piece, where it ends, and what casts a shadow.
/// This is the only place where a shadow's label is decided.
///
/// Between two neighbouring rays that hit different surfaces, the surface of the lower ray hides
/// what lies between their ranges. A surface that ends in the water (the next ray within the beam
/// hits nothing) hides all behind it up to the range of the fan, or up to where the line of sight
/// leaves the seafloor. So does a surface at the fan's upper edge, if that edge is level or looks
/// up. Where a ray hits the back of a face, the surface has a hole, and there is no shadow. Facets
/// may be so small that rays step over them. Then the bed continues between two facets that lie in
/// one plane.
///
/// An object hides the bed from the place where the rays below the object saw the bed last, because
/// there is water between that place and a floating object. If only water is seen between a crest
/// of the bed and an object above the crest, then the crest hides what lies behind them, and the
/// object hides nothing.
class SurfaceWalk {
 public:
  /// lowest and highest are the seafloor's bounds in x and y, local metres.
  SurfaceWalk(const Eigen::Vector2d& lowest, const Eigen::Vector2d& highest, double bin_m)
      : lowest_(lowest), highest_(highest), bin_m_(bin_m) {}

  /// Sets from_m, until_m and starts_surface of the pieces of a plane where they break; adds a
  /// piece for each surface that continues beyond the range. compute_echoes() must have filled the
  /// table.
  void walk(const SectorView& view, std::size_t plane, PieceTable& pieces);

  /// The shadows of the plane that was walked last.
  std::span<const Shadow> shadows() const { return shadows_; }

 private:
  static constexpr std::size_t none = static_cast<std::size_t>(-1);

  bool continues(std::size_t a, std::size_t b) const;
  bool meet(std::size_t a, std::size_t b) const;
  bool leads_to(std::size_t piece, std::size_t ray, double there_m, double apart_m) const;
  bool has_in_plane(std::size_t piece, std::size_t other, double apart_m) const;
  void end_surface(std::size_t last, std::size_t next);
  void begin_surface(std::size_t piece);
  bool is_object(std::size_t piece) const;
  double hides_from_m(std::size_t caster);
  void end_in_water(std::size_t piece);
  void end_plane(std::size_t last);
  Eigen::Vector3d last_ray(std::size_t piece) const;
  double half_m(std::size_t piece) const;
  bool reaches_range(std::size_t piece) const;
  double on_plane_m(std::size_t piece, std::size_t ray) const;
  void continue_beyond_range(std::size_t piece, double next_m);
  void shade_beyond(std::size_t caster);
  double longest_edge_m(std::uint32_t index) const;

  Eigen::Vector2d lowest_, highest_;
  double bin_m_;
  std::vector<Shadow> shadows_;

  // Of the plane that is walked:
  const SectorView* view_ = nullptr;
  std::size_t plane_ = 0;
  PieceTable* pieces_ = nullptr;
  std::span<const RayLayout::Stretch> stretches_;  // the present one, and those to come
  std::size_t caster_ = none;  // the last surface that ended and hides what is behind
  std::size_t crest_ = none;   // the bed's last piece, if it ended in the water
  std::size_t seen_ = 0;       // last_bed_m_ contains the pieces before this one
  double last_bed_m_ = 0.0;    // range to which the bed was seen last
};

}  // namespace ensonify::engine
