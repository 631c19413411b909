#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <ensonify/refine/fan_volume.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::refine {

/// A ball around a box. The radius includes the rounding of middle and radius.
inline Sphere ball_around(const Bounds& box) {
  const Eigen::Vector3f middle = 0.5f * box.lowest + 0.5f * box.highest;
  const Eigen::Vector3f half = (box.highest - middle).cwiseMax(middle - box.lowest);
  return {middle, half.norm() * (1.0f + 1e-6f)};
}

/// An immutable tree of balls around triangles, to find the triangles that fan volumes can touch.
class BallTree {
 public:
  BallTree() = default;
  /// The triangles must outlive this object. `stop_check` is called for each node over 65536 faces
  /// or more; its exceptions end the work.
  explicit BallTree(Triangles triangles, const std::function<void()>& stop_check = {});

  const Triangles& triangles() const { return triangles_; }
  std::size_t bytes() const;

  using Corners = std::array<Eigen::Vector3f, 3>;
  /// Calls take(face, its Corners) for every triangle that the volumes can touch, and some others.
  template <class Take>
  void walk(const ViewTest& view, Take&& take) const {
    for (std::size_t i = 0; i < nodes_.size();) {
      const Node& node = nodes_[i];
      if (!view.touches(node.ball)) {
        i = node.next;
        continue;
      }
      for (std::uint32_t k = 0; k < node.count; ++k) {
        const std::size_t place = std::size_t{node.first} + k;
        take(order_[place], corners_[place]);
      }
      ++i;
    }
  }

 private:
  /// Nodes are in preorder. A leaf has `count` triangles, from order_[first] on; others have none.
  struct Node {
    Sphere ball;
    std::uint32_t next = 0;  // the node after all below this one
    std::uint32_t first = 0, count = 0;
  };
  void grow(std::uint32_t first, std::uint32_t end, std::span<const Eigen::Vector3f> middles,
            const std::function<void()>& stop_check);

  Triangles triangles_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;
  std::vector<Corners> corners_;  // in the order of order_, in which walk() reads them
};

}  // namespace ensonify::refine
