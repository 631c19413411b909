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
#include <ensonify/refine/fan_volume.h>
#include <ensonify/refine/triangle_mesh.h>
#include <ensonify/scatter/eigenray_grid.h>

namespace ensonify::engine {

struct RayIncidence;

/// The fan's bent rays, all at once: each vertex that the fan can touch is put where its own bent
/// ray would have it, were that straight and as long as its time; there all rays are straight, and
/// a scan of the fan finds their faces. The picture of a face is not quite flat: faces are cut
/// until theirs are, within a tolerance, and where that would still be a time's, the exact ray is
/// cut with the face.
///
/// It holds for rays that go down to what lies below the sonar without turning. What others may
/// hit, it leaves to be asked.
class StraightenedSpace {
 public:
  /// Faces lie between these depths. The profile must outlive this.
  StraightenedSpace(const scatter::SoundSpeedProfile& profile, double shallowest_m,
                    double deepest_m, double reference_mps, double tolerance_m);

  /// Nearest hits by ray number, of the rays within the beam, but for those that `left` names (by
  /// number, ascending), which are misses. Their t is within the tolerance until they are told; u
  /// and v are of a part of the face. False where something of the seafloor stands as high as the
  /// sonar, or the fan is wider than a half turn: nothing is told of any ray then. The fan's bend
  /// must be the profile's. Fan and triangles must stay while hits are told; triangles of one
  /// version are the same ones.
  bool trace(const RayFan& fan, refine::Triangles triangles, std::uint64_t version,
             std::span<Hit> hits, std::vector<std::uint32_t>& left);

  /// How a ray that was traced last came to its hit, which gets its exact t.
  RayIncidence tell(std::size_t number, Hit& hit);

 private:
  struct Group {  // of faces in a row
    Eigen::Vector3f middle, half;
  };
  struct Seen {                                                  // a point as its ray sees it
    double cotangent = std::numeric_limits<double>::infinity();  // none comes there
    double mps = 0.0;
    double scale =
        0.0;  // metres in the picture for one there, across the ray in its vertical plane
  };
  static constexpr std::size_t group_faces = 16, groups_together = 16;

  void group();
  void gather();
  std::uint32_t see(const Eigen::Vector3d& point);
  std::uint32_t vertex_of(std::uint32_t vertex);
  double bow_m(const Seen& a, const Seen& b, double length_m) const;
  void lay(const refine::Face& whole, std::uint32_t place);
  bool picture();
  bool may_hit(double level, double down, double farthest_m) const;

  const scatter::SoundSpeedProfile* profile_;
  double shallowest_m_, deepest_m_, reference_mps_;
  double tolerance_m_;
  scatter::EigenrayGrid ways_;
  std::unique_ptr<Intersector> scan_;

  // Of a surface as long as it stays: boxes around its faces' groups, and around groups of these.
  std::optional<std::uint64_t> grouped_version_;
  std::vector<Group> groups_, larger_;

  // Of a fan.
  const RayFan* fan_ = nullptr;
  refine::Triangles triangles_;
  refine::ViewTest view_;
  std::vector<std::uint32_t> places_;                           // of the faces gathered
  std::vector<std::pair<std::uint32_t, std::uint32_t>> slots_;  // vertex and point, by the hash
  std::vector<Eigen::Vector3d> points_;                         // of the sea, local metres
  std::vector<Seen> seen_;                                      // one a point
  refine::TriangleMesh mesh_;                 // of the picture, about the fan's origin; one a point
  std::vector<refine::Face> open_;            // pieces of a face that is being cut
  std::vector<std::uint32_t> picture_place_;  // of the picture's faces, among the triangles
  std::vector<std::uint32_t> piece_;          // of the picture that a ray hit, by its number
  bool stands_high_ = false;
  double flattest_ = 0.0;  // cotangent of the rays that the picture is whole for
  double source_mps_ = 0.0, fastest_above_mps_ = 0.0, min_range_m_ = 0.0;
};

}  // namespace ensonify::engine
