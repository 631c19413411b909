#include <ensonify/refine/ball_tree.h>

#include <algorithm>
#include <cstddef>
#include <numeric>

#include <Eigen/Geometry>

namespace ensonify::refine {
namespace {

constexpr std::uint32_t max_in_leaf = 8;
constexpr std::uint32_t checked_faces = 65536;  // a node over fewer faces takes only milliseconds

}  // namespace

BallTree::BallTree(Triangles triangles, const std::function<void()>& stop_check)
    : triangles_(triangles), order_(triangles.faces.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  std::vector<Eigen::Vector3f> middles;  // of the faces, times three
  middles.reserve(order_.size());
  for (const auto& [a, b, c] : triangles_.faces)
    middles.emplace_back(triangles_.positions[a] + triangles_.positions[b] +
                         triangles_.positions[c]);
  if (!order_.empty()) grow(0, static_cast<std::uint32_t>(order_.size()), middles, stop_check);
  corners_.reserve(order_.size());
  for (const std::uint32_t number : order_) {
    const Face& face = triangles_.faces[number];
    corners_.push_back({triangles_.positions[face[0]], triangles_.positions[face[1]],
                        triangles_.positions[face[2]]});
  }
}

std::size_t BallTree::bytes() const {
  return nodes_.size() * sizeof(Node) + order_.size() * (sizeof(std::uint32_t) + sizeof(Corners));
}

/// Adds the node over order_[first] to order_[end - 1], and the nodes below it.
void BallTree::grow(std::uint32_t first, std::uint32_t end,
                    std::span<const Eigen::Vector3f> middles,
                    const std::function<void()>& stop_check) {
  if (stop_check && end - first >= checked_faces) stop_check();
  Eigen::AlignedBox3f box, of_middles;
  for (std::uint32_t i = first; i < end; ++i) {
    for (const std::uint32_t corner : triangles_.faces[order_[i]])
      box.extend(triangles_.positions[corner]);
    of_middles.extend(middles[order_[i]]);
  }
  const std::size_t number = nodes_.size();
  nodes_.push_back({.ball = ball_around({box.min(), box.max()})});
  if (end - first <= max_in_leaf) {
    nodes_[number].first = first;
    nodes_[number].count = end - first;
  } else {
    Eigen::Index axis = 0;
    of_middles.sizes().maxCoeff(&axis);
    const std::uint32_t half = first + (end - first) / 2;
    const auto at = [&](std::uint32_t i) { return order_.begin() + std::ptrdiff_t{i}; };
    std::nth_element(at(first), at(half), at(end), [&](std::uint32_t a, std::uint32_t b) {
      const float ma = middles[a][axis], mb = middles[b][axis];
      return ma < mb || (ma == mb && a < b);
    });
    grow(first, half, middles, stop_check);
    grow(half, end, middles, stop_check);
  }
  nodes_[number].next = static_cast<std::uint32_t>(nodes_.size());
}

}  // namespace ensonify::refine
