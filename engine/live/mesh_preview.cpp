#include <ensonify/engine/live/mesh_preview.h>

#include <cmath>

#include <fmt/format.h>

#include <ensonify/engine/trace/face_sources/exact_faces.h>
#include <ensonify/refine/tile_collapse.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t max_faces = 80'000;
constexpr double steps = 32000.0;  // MeshPatch::step_m from the middle to the edge; fits an int16

std::shared_ptr<const refine::ProgressiveMesh> progressive_of(
    const Seafloor& seafloor, const MemoryLimit& memory, const std::function<void()>& stop_check) {
  if (seafloor.progressive) return seafloor.progressive;
  if (seafloor.in_tiles())
    throw Error(
        "the bed is made in tiles, only where pings need it; for the mesh, all of it must be there");
  memory.require(static_cast<double>(seafloor.faces) *
                     (refine::mesh_bytes_per_face + refine::tile_collapse_bytes_per_face),
                 fmt::format("the {} faces of the seafloor and their analysis", seafloor.faces),
                 "use larger cells or a smaller area");
  return with_memory_for("the mesh for display", [&] {
    return make_progressive_mesh(seafloor.whole_mesh(stop_check), 1, stop_check);
  });
}

}  // namespace

MeshPreview::MeshPreview(const Seafloor& seafloor, const MemoryLimit& memory,
                         const std::function<void()>& stop_check)
    : progressive_(progressive_of(seafloor, memory, stop_check)),
      mesh_(std::make_unique<refine::ActiveMesh>(*progressive_)) {}

MeshPatch MeshPreview::look(std::span<const refine::FanVolume> volumes, double within_m) {
  const refine::RefineStatistics did = mesh_->refine(volumes);
  counts_ = {.splits = did.splits,
             .collapses = did.collapses,
             .active_faces = mesh_->face_count(),
             .exact_faces = mesh_->exact_faces().faces.size()};

  MeshPatch patch{.middle = volumes.front().apex, .step_m = 4.0 * within_m / steps};
  const auto middle = patch.middle.cast<float>().eval();
  const auto nodes = mesh_->nodes();
  const auto gather = [&](bool exact) {
    for (const refine::ActiveMesh::ActiveFace& face : mesh_->faces()) {
      if (face.slot == refine::ActiveMesh::none || patch.exact.size() >= max_faces) continue;
      bool leaves = true, fits = true;
      std::array<Eigen::Vector3f, 3> corners;
      for (std::size_t k = 0; k < 3; ++k) {
        leaves = leaves && nodes[face.vertices[k]].is_leaf();
        corners[k] = mesh_->position(face.vertices[k]) - middle;
        fits = fits && corners[k].cwiseAbs().maxCoeff() < 3.9 * within_m;
      }
      if (leaves != exact || !fits) continue;
      const Eigen::Array3f low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]);
      const Eigen::Array3f high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
      // The horizontal distance of the face's bounding box from the apex.
      if (low.max(-high).max(0.0f).head<2>().matrix().norm() > within_m) continue;
      for (const Eigen::Vector3f& corner : corners)
        for (int k = 0; k < 3; ++k)
          patch.corners.push_back(static_cast<std::int16_t>(std::lround(corner[k] / patch.step_m)));
      patch.exact.push_back(exact ? 1 : 0);
    }
  };
  gather(false);
  gather(true);
  return patch;
}

}  // namespace ensonify::engine
