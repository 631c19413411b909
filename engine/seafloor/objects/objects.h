#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <ensonify/engine/base/work_control.h>
#include <ensonify/engine/seafloor/bed_height.h>
#include <ensonify/engine/seafloor/material.h>
#include <ensonify/engine/seafloor/memory_plan.h>
#include <ensonify/engine/seafloor/object_mesh.h>
#include <ensonify/engine/seafloor/objects/object_body.h>
#include <ensonify/engine/seafloor/objects/object_options.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/refine/mesh_repair.h>

namespace ensonify::engine {

/// All objects of a scene at their final places.
struct PlacedObjects {
  struct One {
    refine::TriangleMesh mesh;  ///< local metres, as rays see it
    ObjectMesh own;
    ObjectRecord record;
    std::vector<ObjectPart> parts;         ///< all different; number 0 is the object's own label
    std::vector<std::uint16_t> face_part;  ///< number of each face's part; empty: all 0
  };
  std::vector<One> objects;  ///< in the order of the tables, those of one table by number
  /// One per mesh file.
  std::vector<std::pair<std::filesystem::path, refine::RepairReport>> repairs;
  /// About meshes so large that a vertex may be misplaced, facets too coarse for their material's
  /// lobe, and objects so far away that floats turn their facets.
  std::vector<std::string> warnings;
};

/// For each table the number of the one whose object it belongs to: of its assembly's first table,
/// or its own.
std::vector<std::size_t> bases_of(std::span<const ObjectOptions> tables);

/// The number of objects that the tables make; an assembly is one.
std::size_t count_of(std::span<const ObjectOptions> tables);

/// Reads, makes and sets down the objects of every table or assembly. Objects with a given place
/// come first; then those at random places, which keep their distance from all earlier ones. Object
/// k of table t draws its place, heading and size from its own random streams, so another table
/// changes them only if its objects occupy the place. Throws SceneError with the scene's key of the
/// table at fault, for a mesh or path that cannot be read, for a place without a bed below it, for
/// objects that find no room and for sizes that contradict one another; MemoryError for a mesh or
/// objects that do not fit. Does not depend on the number of threads.
PlacedObjects place_objects(std::span<const ObjectOptions> tables, std::uint64_t seed,
                            const BedGrid& bed, std::span<const Material> materials = {},
                            const MemoryPlan& plan = {}, const WorkControl& control = {});

}  // namespace ensonify::engine
