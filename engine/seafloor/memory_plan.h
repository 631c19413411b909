#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include <ensonify/engine/base/memory.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// The memory limit of make_seafloor(), and the memory that later stages need.
///
/// Every estimate is a lower bound: it counts only what is certainly allocated at the same time, so
/// no seafloor that fits is refused. The heights of a survey are counted before the survey is read.
/// Its faces are counted when they are known, because holes make no faces. For random layers, the
/// need of each is counted.
struct MemoryPlan {
  MemoryLimit limit;
  double bytes_per_face = 0.0;  ///< for what is built over the mesh: a tree, or the analysis
  double more_bytes = 0.0;      ///< for what is allocated at the same time, such as a run's images
};

/// Reads a mesh that refine::repair() will copy. Throws what refine::read_mesh() throws, and
/// MemoryError, with the remedy, if the mesh and its repair cannot fit.
refine::TriangleMesh read_mesh_to_repair(const std::filesystem::path& file, const MemoryPlan& plan,
                                         std::string_view remedy,
                                         const std::function<void()>& stop_check = {});

/// Throws MemoryError if an object with this number of faces cannot fit. `faces_before` counts the
/// faces of the objects before this object; these faces exist already, but nothing is built over
/// them yet. `what` names the object.
void require_object_fits(double faces, double faces_before, const std::string& what,
                         const MemoryPlan& plan);

}  // namespace ensonify::engine
