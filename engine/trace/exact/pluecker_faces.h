#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/trace/exact/box_tree.h>
#include <ensonify/engine/trace/ray.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// A ray prepared for the test, and the nearest hit found so far.
class PlueckerQuery {
 public:
  /// Throws as check_ray does.
  explicit PlueckerQuery(const Ray& ray);

  const BoxLine& line() const { return line_; }
  /// No face beyond this distance can be hit any more. In lengths of the direction as scaled below.
  const double& limit() const { return limit_; }
  /// The nearest face met; at equal distance the one with the lowest number, then the first.
  const Hit& nearest() const { return nearest_; }

 private:
  friend class PlueckerFaces;

  int doublings_;  // of a very short direction, so that it can be divided by
  Eigen::Vector3d origin_;
  Eigen::Vector3d direction_;
  Eigen::Vector3d moment_;  // origin x direction
  double largest_origin_;
  double largest_direction_;
  BoxLine line_;
  double t_min_, t_max_;
  double limit_;
  Hit nearest_;
};

/// Triangles with the Plücker coordinates of their edges, each edge stored once and shared by its
/// faces, for the paper's test: a ray hits a face if it passes the three edges on the same side.
/// The sides of two edges reject most faces; the third decides. A side within rounding of a tie is
/// decided by exact_side with its tie rule.
class PlueckerFaces {
 public:
  /// Keeps a view of the triangles. Throws refine::MeshError for a vertex that is not finite or
  /// beyond 1e18, and for more than 715 million faces. `stop_check` is called now and then; what it
  /// throws ends the building.
  void build(refine::Triangles triangles, const std::function<void()>& stop_check);

  std::uint32_t count() const { return static_cast<std::uint32_t>(faces_.size()); }
  Box box(std::uint32_t face) const;

  /// Makes the face the query's nearest hit if it is nearer.
  void meet(PlueckerQuery& query, std::uint32_t face) const;

 private:
  // One cache line. The end that is lower in (x, y, z) is `from`: so an edge's bits depend only on
  // the places of its ends, not on how the vertices are numbered.
  struct Edge {
    Eigen::Vector3d along;   // to - from
    Eigen::Vector3d moment;  // from x to, computed as from x along: its rounding is small
    std::uint32_t from, to;
    float slack;  // 20 u (|along_x| + |along_y| + |along_z|)
    float reach;  // from's largest component
  };
  struct Side {
    double product;
    int sign;
  };
  Edge edge_between(std::uint32_t from, std::uint32_t to) const;
  Side side(const PlueckerQuery& query, std::uint32_t half_edge) const;
  void take(PlueckerQuery& query, std::uint32_t face, const std::array<Side, 3>& sides) const;

  refine::Triangles triangles_;
  std::vector<Edge> edges_;
  // By face: twice the edge's number, plus one if the face runs against its direction.
  std::vector<std::array<std::uint32_t, 3>> faces_;
};

}  // namespace ensonify::engine
