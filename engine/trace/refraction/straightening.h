#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <span>

#include <Eigen/Core>

#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/engine/trace/refraction/ray_incidence.h>
#include <ensonify/engine/trace/refraction/straighten_kernel.h>
#include <ensonify/scatter/eigenray_grid.h>

namespace ensonify::engine {

/// The map that makes the bent rays of one source straight. Each point of the sea moves to the end
/// of a straight ray: with the launch direction of the bent ray to the point, and with the length
/// of its travel time at the reference speed. In that straightened space a scan of a fan finds what
/// the bent rays hit.
///
/// The map has only the rays that go down from the source without turning.
class Straightening {
 public:
  /// For points between these two depths. The profile must outlive this.
  Straightening(const scatter::SoundSpeedProfile& profile, double shallowest_m, double deepest_m,
                double reference_mps);

  /// Moves the source to the origin of a fan, which must stay as long as its rays are asked for.
  void start(const RayFan& fan);

  /// Faces in straightened space have no longer edges.
  static constexpr double longest_edge_m = 2.0;
  /// The ray to a point.
  struct RayToPoint {
    double cotangent = std::numeric_limits<double>::infinity();  ///< at launch; infinite: no ray
    /// Jacobian of the map at the point. The last row is zero: it fills the vector registers.
    Eigen::Matrix<float, 4, 3> jacobian = Eigen::Matrix<float, 4, 3>::Zero();
  };
  /// Where a point moves, from the source; zero if no known ray reaches it. Returns false if the
  /// point is not clearly below the source.
  bool move(const Eigen::Vector3d& point, RayToPoint& ray, Eigen::Vector3f& to);
  /// The same for the points (x_m[i], y_m, z_m[i]) of a row. The memory of x_m, z_m and the
  /// Jacobians is longer than the points by points_padding. Also returns false if no known ray
  /// reaches one of the points.
  bool move(std::span<const float> x_m, double y_m, std::span<const float> z_m,
            const MovedPointRows& to);
  /// Eight times the distance, squared, from the middle of an edge to the middle of its chord in
  /// straightened space.
  static float bow8_m2(const RayToPoint& a, const RayToPoint& b, const Eigen::Vector3f& edge);
  /// The greatest bow8_m2 of the edges of a face that is flat within a tolerance.
  static float most_bow8_m2(double tolerance_m);

  /// The largest cotangent of the known rays.
  double flattest() const { return eigenrays_.rays().flattest(); }
  /// Whether a ray that is not known may hit something within its range: a ray of the fan whose
  /// direction has these components.
  bool may_hit(double level, double down) const;

  /// A face, or a part of it, by corner.
  struct Piece {
    std::array<Eigen::Vector3d, 3> in_sea;
    std::array<Eigen::Vector3f, 3> straightened;  ///< from the source
  };
  /// How a known ray of the fan arrives at its hit on a piece, whose t becomes exact.
  RayIncidence incidence(std::size_t number, const Piece& piece, Hit& hit);

 private:
  double way_down_m(double cotangent) const;
  double way_back_m(double level) const;

  const scatter::SoundSpeedProfile* profile_;
  double shallowest_m_, reference_mps_;
  scatter::EigenrayGrid eigenrays_;

  const RayFan* fan_ = nullptr;
  double source_mps_ = 0.0;
  double highest_face_m_ = 0.0;  // depth of the highest face
  double longest_m_ = 0.0;       // the flattest known ray's way down to this depth
  double min_range_m_ = 0.0;     // least range of unknown rays at this depth
  double fastest_above_mps_ = 0.0, slowest_above_mps_ = 0.0, steepest_above_ = 0.0;
};

}  // namespace ensonify::engine
