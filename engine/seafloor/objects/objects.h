#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <ensonify/engine/seafloor/bed_height.h>
#include <ensonify/engine/seafloor/material.h>
#include <ensonify/engine/seafloor/objects/object_options.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/refine/mesh_repair.h>

namespace ensonify::engine {

/// All objects of a scene, where they came to lie.
struct PlacedObjects {
  struct One {
    refine::TriangleMesh mesh;
    ObjectRecord record;
  };
  std::vector<One> objects;  ///< in the tables' order, those of one table by number
  std::vector<std::pair<std::filesystem::path, refine::RepairReport>> repairs;  ///< one a mesh file
  /// Of meshes that reach so far that a vertex may be astray, and of facets too coarse for their
  /// material's lobe.
  std::vector<std::string> warnings;
};

/// The body of a table by itself, in metres about its middle: a file's mesh, repaired and scaled,
/// or a shape's, whose facets are as fine as its material's lobe asks for. Throws refine::MeshError
/// for a mesh that cannot be read, std::invalid_argument for sizes that contradict one another and
/// for what is laid along a path.
refine::TriangleMesh mesh_of(const ObjectOptions& table, std::uint64_t seed,
                             std::span<const Material> materials = {});

/// How many objects the tables make.
std::size_t count_of(std::span<const ObjectOptions> tables);

/// Reads, makes and sets down the objects of every table. Those at random places come after all
/// that have theirs, and keep clear of them; number k of table t draws its place, heading and size
/// from streams of its own, so that no other table changes them but by standing in the way. Throws
/// refine::MeshError for a mesh or path that cannot be read, for a place without a bed below and
/// for objects that find no room; std::invalid_argument for sizes that contradict one another.
PlacedObjects place_objects(std::span<const ObjectOptions> tables, std::uint64_t seed,
                            const BedGrid& bed, std::span<const Material> materials = {});

}  // namespace ensonify::engine
