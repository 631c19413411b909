#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/sonar/echo/object_visibility.h>
#include <ensonify/engine/trace/fan_runs.h>
#include <ensonify/engine/trace/ray_fan.h>

namespace ensonify::engine {

/// Counts how much of each object the pings of one sonar see. Straight rays only.
///
/// A plane of the fan cuts an object's faces in segments, which cover intervals of the plane's
/// rays. The union of these intervals is the rays that would meet the object if it were alone. An
/// object of more than about 2000 faces is counted only every few pings, so that counting takes
/// only a small part of the time of a ping.
class VisibilityCounter {
 public:
  /// The seafloor must outlive this.
  explicit VisibilityCounter(const Seafloor& seafloor);

  /// Counts one sector of a ping. runs: the hits of its fan on these triangles, which must include
  /// all faces of objects that the fan can touch.
  void look(const RayFan& fan, refine::Triangles triangles, const FanRuns& runs,
            std::uint64_t ping);
  /// One per object of the seafloor.
  std::span<const ObjectVisibility> visibilities() const { return visibilities_; }

 private:
  struct Object {
    Eigen::Vector3d middle;
    double radius_m;
    std::uint32_t first_face, faces;  // numbers
    std::uint64_t every;              // pings
  };
  bool in_view(const Object& object, const RayFan& fan) const;
  void find_faces(refine::Triangles triangles);
  void cover(const RayFan& fan, refine::Triangles triangles, std::uint32_t face);
  void cover_plane(const RayFan& fan, std::size_t plane, const Eigen::RowVector3d& beside,
                   const Eigen::RowVector3d& ahead, const Eigen::RowVector3d& up);

  std::vector<Object> objects_;
  std::vector<ObjectVisibility> visibilities_;
  std::vector<std::uint32_t> wanted_;  // objects of this ping, ascending
  std::vector<std::pair<std::uint32_t, std::uint32_t>> their_faces_;  // object, place; by object
  std::vector<std::pair<std::uint32_t, std::uint32_t>> found_;        // number in wanted_, place
  std::vector<std::size_t> first_of_wanted_;                          // in their_faces_
  std::vector<double> tangents_;                                      // of the planes' azimuths
  struct Span {
    std::size_t from, until;
  };
  std::vector<std::uint8_t> covered_;  // rays of an object
  std::vector<Span> spans_;            // by plane: first and end of these rays
};

}  // namespace ensonify::engine
