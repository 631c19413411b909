#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/trace/intersector.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/engine/trace/refraction/ray_incidence.h>
#include <ensonify/refine/fan_volume.h>
#include <ensonify/refine/triangle_mesh.h>
#include <ensonify/scatter/eigenray_grid.h>

namespace ensonify::engine {

/// The sea, deformed so that the fan's bent rays are straight. Each point of a face moves to the
/// end of a straight ray: with the launch direction of the bent ray to the point, and with the
/// length of its travel time at the reference speed. In that space a scan of the fan finds the
/// faces that the rays hit.
///
/// A flat face is not quite flat there. Faces are cut until their parts are flat within a
/// tolerance; incidence_of() removes the error in time that remains, by cutting the exact ray with
/// the face.
///
/// It decides the rays that go down, without turning, to faces below the sonar. Other rays stay
/// undecided if they may hit something.
class StraightenedSpace {
 public:
  /// Faces lie between these two depths. The profile must outlive this.
  StraightenedSpace(const scatter::SoundSpeedProfile& profile, double shallowest_m,
                    double deepest_m, double reference_mps, double tolerance_m);

  /// Finds the nearest hits, by ray number, of the rays within the beam. The undecided rays (their
  /// numbers, ascending) are misses. The t of a hit is within the tolerance until incidence_of() is
  /// asked; its u and v are those of a part of the face. False, with no ray decided, where
  /// something of the seafloor stands as high as the sonar, or the fan is wider than a half turn.
  /// The fan's bend must be the profile's (bend_of). The fan and the triangles must stay until the
  /// last incidence_of().
  bool trace(const RayFan& fan, const TracedFaces& faces, std::span<Hit> hits,
             std::vector<std::uint32_t>& undecided);

  /// How a ray of the last trace arrives at its hit, whose t becomes exact.
  RayIncidence incidence_of(std::size_t number, Hit& hit);

 private:
  /// The box around some faces that follow each other.
  struct Group {
    Eigen::Vector3f middle, half;
  };
  /// The ray to a point.
  struct RayToPoint {
    double cotangent = std::numeric_limits<double>::infinity();  // at launch; infinite: no ray
    // Jacobian of the map from the sea to straightened space, at the point. The last row is zero:
    // it fills the vector registers.
    Eigen::Matrix<float, 4, 3> jacobian = Eigen::Matrix<float, 4, 3>::Zero();
  };
  static constexpr std::size_t group_size = 16, groups_together = 16;

  void group_faces();
  void collect_faces();
  std::uint32_t add_point(const Eigen::Vector3d& point);
  std::uint32_t point_of(std::uint32_t vertex);
  static float bow8_m2(const RayToPoint& a, const RayToPoint& b, const Eigen::Vector3d& edge);
  void add_face(const refine::Face& whole, std::uint32_t place);
  bool straighten_faces();
  bool may_hit(double level, double down, double farthest_m) const;

  const scatter::SoundSpeedProfile* profile_;
  double shallowest_m_, deepest_m_, reference_mps_;
  double tolerance_m_;
  scatter::EigenrayGrid eigenrays_;
  std::unique_ptr<Intersector> scan_;

  // Valid while the version of the triangles stays the same: boxes around groups of faces, and
  // around groups of these groups.
  std::optional<std::uint64_t> grouped_version_;
  std::vector<Group> groups_, larger_;

  // Of the fan that was traced last:
  const RayFan* fan_ = nullptr;
  refine::Triangles triangles_;
  refine::ViewTest view_;
  std::vector<std::uint32_t> collected_;  // faces, by their place among the triangles
  std::vector<std::pair<std::uint32_t, std::uint32_t>> point_slots_;  // hash table: vertex, point
  std::vector<Eigen::Vector3d> points_;    // by point: its place in the sea, local metres
  std::vector<RayToPoint> rays_;           // by point
  refine::TriangleMesh mesh_;              // of straightened space, about the fan's origin
  std::vector<refine::Face> open_;         // parts of a face that are still to be cut
  std::vector<std::uint32_t> face_place_;  // by face of mesh_: its place among the triangles
  std::vector<std::uint32_t> hit_piece_;   // by ray number: the face of mesh_ that it hit
  bool stands_high_ = false;               // a face is as high as the sonar
  double flattest_ = 0.0;                  // rays of smaller cotangent meet no missing face
  double source_mps_ = 0.0, fastest_above_mps_ = 0.0, min_range_m_ = 0.0;
};

}  // namespace ensonify::engine
