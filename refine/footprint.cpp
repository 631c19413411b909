#include <ensonify/refine/footprint.h>

namespace ensonify::refine {

Footprint::Footprint(const ProgressiveMesh& mesh)
    : mesh_(&mesh), reached_((mesh.points.size() + 63) / 64, 0) {}

ExactFaces Footprint::query(std::span<const FanVolume> volumes) {
  view_.look_at(volumes);
  for (const std::uint32_t leaf : leaves_) reached_[leaf / 64] = 0;
  leaves_.clear();
  split_.clear();
  pending_.clear();  // a query that found damage may have left some
  for (std::uint32_t r = 0; r < mesh_->roots.size(); ++r)
    descend({mesh_->roots[r] - r, mesh_->roots[r], mesh_->end_of(r)});
  const std::size_t found = collect();
  return {mesh_->points, std::span(faces_).first(found), std::span(source_faces_).first(found)};
}

void Footprint::descend(Branch branch) {
  for (;;) {
    const auto [node, lo, hi] = branch;
    if (hi - lo == 1) {
      mesh_->verify_leaf(lo);
      leaves_.push_back(lo);
      reached_[lo / 64] |= std::uint64_t{1} << lo % 64;
    } else {
      mesh_->verify_node(node);
      if (view_.touches(mesh_->spheres[node])) {
        const std::uint32_t mid = mesh_->mid_of(node, lo, hi);
        split_.push_back(node);
        __builtin_prefetch(mesh_->spheres.data() + node + (mid - lo));  // load the other child
        pending_.push_back({node + (mid - lo), mid, hi});
        branch = {node + 1, lo, mid};
        continue;
      }
    }
    if (pending_.empty()) return;
    branch = pending_.back();
    pending_.pop_back();
  }
}

std::size_t Footprint::collect() {
  const std::size_t inner_slots = 2 * mesh_->mid.size();
  const std::size_t most = 2 * split_.size() + mesh_->faces.size() - inner_slots;
  if (faces_.size() < most) {
    faces_.resize(most);
    source_faces_.resize(most);
  }
  // Each face is written, then kept or overwritten: the processor would often mispredict a branch.
  std::size_t found = 0;
  const auto take = [&](std::size_t slot) {
    const Face face = mesh_->faces[slot];
    if (face[0] == ProgressiveMesh::none) return;
    faces_[found] = face;
    source_faces_[found] = mesh_->source_face[slot];
    found += reached(face[0]) & reached(face[1]) & reached(face[2]);
  };
  for (const std::size_t node : split_) {
    take(2 * node);
    take(2 * node + 1);
  }
  for (std::size_t slot = inner_slots; slot < mesh_->faces.size(); ++slot) take(slot);
  return found;
}

}  // namespace ensonify::refine
