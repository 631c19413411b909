#include <ensonify/refine/progressive_mesh.h>

#include <utility>

namespace ensonify::refine {
namespace {

Bounds bounds_of(const ProgressiveMeshArrays& mesh) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  Bounds box{Eigen::Vector3f::Constant(infinity), Eigen::Vector3f::Constant(-infinity)};
  for (const Face& face : mesh.faces)
    if (face[0] != ProgressiveMesh::none)
      for (const std::uint32_t leaf : face) {
        box.lowest = box.lowest.cwiseMin(mesh.points[leaf]);
        box.highest = box.highest.cwiseMax(mesh.points[leaf]);
      }
  return box.lowest[0] <= box.highest[0] ? box : Bounds{};
}

}  // namespace

ProgressiveMesh::ProgressiveMesh(ProgressiveMeshArrays arrays)
    : arrays_(std::make_shared<const ProgressiveMeshArrays>(std::move(arrays))) {
  points = arrays_->points;
  mid = arrays_->mid;
  spheres = arrays_->spheres;
  order = arrays_->order;
  faces = arrays_->faces;
  source_face = arrays_->source_face;
  roots = arrays_->roots;
  world_origin = arrays_->world_origin;
  bounds = bounds_of(*arrays_);
  make_flags(true);
}

void ProgressiveMesh::make_flags(bool verified) {
  const std::array<std::size_t, 3> items = {mid.size(), points.size(), tags_.size()};
  for (std::size_t kind = 0; kind < items.size(); ++kind) {
    const std::size_t groups = (items[kind] + group - 1) / group;
    flags_[kind] = std::shared_ptr<Flag[]>(new Flag[groups]);
    for (std::size_t g = 0; g < groups; ++g) flags_[kind][g] = verified;
  }
}

void ProgressiveMesh::verify_all() const {
  for (std::size_t node = 0; node < mid.size(); node += group)
    verify_node(static_cast<std::uint32_t>(node));
  for (std::size_t leaf = 0; leaf < points.size(); leaf += group)
    verify_leaf(static_cast<std::uint32_t>(leaf));
  for (std::size_t number = 0; number < tags_.size(); number += group)
    verify(Kind::tag, static_cast<std::uint32_t>(number));
}

}  // namespace ensonify::refine
