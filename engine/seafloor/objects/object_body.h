#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/seafloor/bed_height.h>
#include <ensonify/engine/seafloor/material.h>
#include <ensonify/engine/seafloor/memory_plan.h>
#include <ensonify/engine/seafloor/objects/object_options.h>
#include <ensonify/refine/mesh_repair.h>

namespace ensonify::engine {

/// Class and material of some faces of an object.
struct ObjectPart {
  std::string class_name, material;
  bool two_sided = false;  ///< as in Label; never true for a shape
  bool operator==(const ObjectPart&) const = default;
};

/// The parts that a table's object can have. The first has the object's own class and material.
std::vector<ObjectPart> parts_of(const ObjectOptions& table);

/// The body of a table without a bed, in metres about its middle: the mesh of a file, repaired and
/// scaled, or the mesh of a shape with facets as small as the lobe of its material needs. If the
/// table has no shape_seed, the form of a shape follows from `seed` and `number`. Throws
/// refine::MeshError for a mesh that cannot be read, std::invalid_argument for sizes that
/// contradict one another and for shapes that are laid along a path.
refine::TriangleMesh mesh_of(const ObjectOptions& options, std::uint64_t seed,
                             std::span<const Material> materials = {}, std::uint64_t number = 0);

/// An object before it is set down.
struct ObjectBody {
  refine::TriangleMesh mesh;
  std::vector<ObjectPart> parts;
  std::vector<std::uint16_t> face_part;  ///< one per face
  double sunk_m = 0.0;                   ///< as in ShapeBody
};

/// Moves a body's middle to x = y = 0, and the bed into which it is sunk by sunk_m to z = 0.
void centre(ObjectBody& body);
/// Adds a member of an assembly to the assembly's base, which must be centred.
void add_member(ObjectBody& base, ObjectBody member, const ObjectOptions& options);

/// Makes the bodies of one of the scene's [[objects]] tables.
struct BodySource {
  ObjectOptions options;
  std::size_t number;
  std::string what;  ///< the name of the table in messages
  std::optional<refine::RepairReport> report;
  /// A warning of a mesh so large that a vertex may be misplaced, or wider than the bed.
  std::optional<std::string> warning;

  /// Reads and repairs the mesh of a file. Throws what mesh_of() throws, and MemoryError.
  BodySource(const ObjectOptions& table, std::size_t its_number, std::uint64_t seed,
             const BedGrid& bed, std::span<const Material> materials, const MemoryPlan& plan);

  /// The shape, or the name of the mesh's file without its folder.
  std::string name() const {
    return options.shape.empty() ? options.mesh.path.filename().string() : options.shape;
  }
  bool is_line() const;
  /// The body with number `copy`. The body of a line has labels only.
  ObjectBody body(std::size_t copy) const;

 private:
  std::uint64_t seed_;
  refine::TriangleMesh mesh_;  // of a file
  bool open_ = false;          // whether mesh_ encloses no volume
};

}  // namespace ensonify::engine
