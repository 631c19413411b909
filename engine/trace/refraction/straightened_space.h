#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/trace/fan_runs.h>
#include <ensonify/engine/trace/intersector.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/engine/trace/refraction/straightening.h>
#include <ensonify/engine/trace/traced_faces.h>
#include <ensonify/refine/fan_volume.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// The faces of a seafloor in straightened space (Straightening), where a scan of the fan finds
/// those that its bent rays hit.
///
/// A flat face is not quite flat there. Faces are cut until their parts are flat within a
/// tolerance; incidence_of() removes the error in time that remains, by cutting the exact ray with
/// the face.
///
/// It decides the rays that go down, without turning, to faces below the sonar. Other rays stay
/// undecided if they may hit something.
class StraightenedSpace {
 public:
  /// The straightening must outlive this.
  StraightenedSpace(Straightening& straightening, double tolerance_m);

  /// Finds the nearest hits, by ray number, of the rays within the beam. The undecided rays (their
  /// numbers, ascending) are misses. The t of a hit is within the tolerance until incidence_of() is
  /// asked; its u and v are those of a part of the face. Returns false, and decides no ray, if
  /// something of the seafloor stands as high as the sonar, or if the fan is wider than a half
  /// turn. The fan's bend must be the profile's (bend_of). The fan and the triangles must stay
  /// until the last incidence_of().
  bool trace(const RayFan& fan, const Faces& faces, std::span<Hit> hits,
             std::vector<std::uint32_t>& undecided);

  /// How a ray of the last trace arrives at its hit, whose t becomes exact.
  RayIncidence incidence_of(std::size_t number, Hit& hit);

 private:
  /// The box around some faces that follow each other.
  struct Group {
    Eigen::Vector3f middle, half;
  };
  static constexpr std::size_t group_size = 16, groups_together = 16;

  void group_faces();
  void collect_faces();
  std::uint32_t add_point(const Eigen::Vector3d& point);
  std::uint32_t point_of(std::uint32_t vertex);
  bool add_face(const refine::Face& whole, std::uint32_t place);
  bool straighten_faces();

  Straightening* straightening_;
  float most_bow8_m2_;
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
  std::vector<Eigen::Vector3d> points_;          // by point: its place in the sea, local metres
  std::vector<Straightening::RayToPoint> rays_;  // by point
  refine::TriangleMesh mesh_;                    // of straightened space, about the fan's origin
  std::vector<refine::Face> open_;               // parts of a face that are still to be cut
  // By face of mesh_: its place among the triangles, and its number.
  std::vector<std::uint32_t> face_place_, face_number_;
  std::size_t parts_ = 0;  // of faces
  FanRuns runs_;
  std::vector<std::uint32_t> hit_piece_;  // by ray number: the face of mesh_ that it hit
  bool stands_high_ = false;              // a face is as high as the sonar
  double flattest_ = 0.0;                 // rays of smaller cotangent meet no missing face
};

}  // namespace ensonify::engine
