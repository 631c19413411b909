#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <ensonify/refine/triangle_mesh.h>
#include <ensonify/refine/view_volume.h>

namespace ensonify::refine {

/// A mesh at many resolutions: the base mesh M0 and the forest of collapses that leads from it back to
/// every original vertex and face. Immutable; shared by all threads.
///
/// Leaves are the original vertices, ranked by depth-first order. Inner nodes are numbered in
/// preorder. A node that covers the leaves [lo, hi) is their common stand-in while it is not split;
/// its children cover [lo, mid) and [mid, hi): inner node i has the children i + 1 and i + (mid - lo),
/// unless such a range holds one leaf, which then is the child itself. lo and hi are known while
/// descending, so mid is all there is to store, and "is this node above leaf l" is lo <= l < hi.
///
/// Faces are original faces. Those at 2i and 2i + 1 are the two that collapse i takes away: the first
/// meets the children in the order (left, right, cut), the second as (right, left, cut), seen along the
/// face's own turn; at a border one slot is empty. The base mesh's faces follow. All name their
/// corners by leaf in the source mesh's corner order, so that a tracer gets the source's bits.
struct ProgressiveMesh {
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  // a leaf
  std::vector<Eigen::Vector3f> points;  ///< local metres
  // an inner node
  std::vector<std::uint32_t> mid;
  std::vector<Sphere> spheres;       ///< around all original faces that touch a leaf of the node
  std::vector<std::uint32_t> order;  ///< of the collapses: 0 was the first, the finest
  // a face: two an inner node, then the base mesh's
  std::vector<Face> faces;  ///< leaves; an empty slot has `none` three times
  std::vector<std::uint32_t>
      source_face;  ///< its number in the source mesh; `none` for an empty slot
  // a vertex of the base mesh
  std::vector<std::uint32_t> roots;  ///< its first leaf; ascending, from 0

  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();

  std::uint32_t leaves() const { return static_cast<std::uint32_t>(points.size()); }
  std::span<const Face> base_faces() const { return std::span(faces).subspan(2 * mid.size()); }
  /// The leaves of base vertex `root` are [roots[root], end_of(root)); its node is roots[root] - root.
  std::uint32_t end_of(std::size_t root) const {
    return root + 1 < roots.size() ? roots[root + 1] : leaves();
  }
};

}  // namespace ensonify::refine
