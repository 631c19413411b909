#include <ensonify/engine/seafloor/memory_plan.h>

#include <system_error>

#include <fmt/format.h>

#include <ensonify/refine/mesh_reader.h>

namespace ensonify::engine {
namespace {

constexpr double repair_bytes_per_face = 75.0;  // in addition to the mesh that was read
// Built over objects: labels, the tree over all objects, and the list of their faces. Flat parts:
// what one object needs while its flat parts are found.
constexpr double built_bytes_per_face = 58.0, flat_parts_bytes_per_face = 500.0;
// The object in its own frame, in doubles (ObjectMesh). It is kept.
constexpr double own_bytes_per_face = sizeof(refine::Face) + 0.5 * sizeof(Eigen::Vector3d);

}  // namespace

refine::TriangleMesh read_mesh_to_repair(const std::filesystem::path& file, const MemoryPlan& plan,
                                         std::string_view remedy,
                                         const std::function<void()>& stop_check) {
  std::error_code unreadable;  // read_mesh() reports it
  if (const auto bytes = std::filesystem::file_size(file, unreadable); !unreadable)
    plan.limit.require(static_cast<double>(bytes) + plan.more_bytes,
                       file.string() + " and what is read of it", remedy);
  refine::TriangleMesh mesh = refine::read_mesh(file, stop_check);
  const auto faces = static_cast<double>(mesh.faces.size());
  plan.limit.require(repair_bytes_per_face * faces + plan.more_bytes,
                     fmt::format("{}: the repair of its {:.0f} faces", file.string(), faces),
                     remedy);
  return mesh;
}

void require_object_fits(double faces, double faces_before, const std::string& what,
                         const MemoryPlan& plan) {
  plan.limit.require(
      (refine::mesh_bytes_per_face + own_bytes_per_face + built_bytes_per_face +
       flat_parts_bytes_per_face) *
              faces +
          built_bytes_per_face * faces_before + plan.more_bytes,
      fmt::format("{}: the {:.3g} million faces of the objects so far and what is built over them",
                  what, 1e-6 * (faces + faces_before)),
      "use a coarser mesh, or fewer copies");
}

}  // namespace ensonify::engine
