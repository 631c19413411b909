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
  std::vector<One> objects;  ///< in the order of the tables, and by number within a table
  /// One per mesh file.
  std::vector<std::pair<std::filesystem::path, refine::RepairReport>> repairs;
  /// Warnings of meshes so large that a vertex may be misplaced, of facets too coarse for the lobe
  /// of their material, and of objects so far away that the rounding of floats turns their facets.
  std::vector<std::string> warnings;
};

/// For each table the number of the first table of its assembly, or the table's own number.
std::vector<std::size_t> bases_of(std::span<const ObjectOptions> tables);

/// The number of objects at rest that the tables make. An assembly is one object.
std::size_t count_of(std::span<const ObjectOptions> tables);

/// Reads, makes and sets down the objects of every table or assembly that are at rest, or with
/// `moving` those that move, at the places from which they start. Objects with a given place
/// are set down first. Then objects at random places are set down, which keep their distance from
/// all earlier objects. Object k of table t draws its place, heading and size from separate random
/// streams, so another table changes them only if its objects occupy the place. Throws SceneError,
/// with the scene's key of the table, for a mesh or path that cannot be read, for a place without a
/// bed below it, for objects that find no room and for sizes that contradict one another;
/// MemoryError for a mesh or objects that do not fit. The number of threads does not matter.
PlacedObjects place_objects(std::span<const ObjectOptions> tables, std::uint64_t seed,
                            const BedGrid& bed, std::span<const Material> materials = {},
                            const MemoryPlan& plan = {}, const WorkControl& control = {},
                            bool moving = false);

}  // namespace ensonify::engine
