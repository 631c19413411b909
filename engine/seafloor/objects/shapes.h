#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/seafloor/object_mesh.h>
#include <ensonify/engine/seafloor/objects/shape_size.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// A size that a shape has: its scene key and its member of ShapeSize.
struct Dimension {
  std::string_view key;
  std::optional<double> ShapeSize::*size;
  double usual_m;      ///< usual value; 0: the size follows from the other sizes
  double max_m = 0.0;  ///< if > 0, a family draws the size from usual_m to max_m
};

/// A part of a shape.
struct ShapePart {
  std::string_view name;
  std::string_view material;  ///< of this part; empty: the material of the object
};

struct FamilyForm;

/// A shape with a name. A family is a shape whose form is drawn; a family has parts.
struct ShapeKind {
  std::string_view name;
  std::string_view help;  ///< what the shape is, and the source of its usual size
  std::vector<Dimension> dimensions;
  std::vector<ShapePart> parts = {};
  std::vector<std::string_view> variants = {};  ///< words for the key `variant`
  void (*family)(FamilyForm&) = nullptr;        ///< makes a member
  /// Whether a member is several things, each sunk into the bed: a burial sinks all of them deeper.
  bool several = false;
  bool along_path = false;  ///< laid along a path, not set down

  /// One size of this shape: the given size, or the usual size if it is unset. Throws
  /// std::invalid_argument for a size that the shape does not have.
  double size_m(const ShapeSize& given, std::optional<double> ShapeSize::*which) const;
};

/// The mesh of a shape.
struct ShapeBody {
  refine::TriangleMesh mesh;
  std::vector<std::uint8_t> face_part;  ///< number in ShapeKind::parts; empty: all 0
  double sunk_m = 0.0;  ///< depth of the lowest point below the bed that a family assumes
};

const std::vector<ShapeKind>& shape_kinds();
/// The shape with this name; - and _ are equal. Throws std::invalid_argument with all names.
const ShapeKind& shape_named(std::string_view name);
/// All dimensions that shapes have, each once.
std::span<const Dimension> all_dimensions();

/// The mesh of a body, z up and y forward: closed, with normals outwards (its parts may overlap).
/// Families and "boulder", "net" and "debris" depend on `random`. A member of a family has exactly
/// the given sizes. If the family's first size is unset, it is drawn; other unset sizes follow from
/// the form. If `variant` is empty, it is drawn. If facet_m is unset, facets are a sixteenth of the
/// diameter long (48 around the body), or as short as facet_rad needs; thin rods have 8 sides.
/// Throws std::invalid_argument for a kind that is laid along a path, a variant that the kind does
/// not have, and sizes that contradict one another.
ShapeBody make_body(const ShapeKind& kind, const ShapeSize& size, const RandomStream& random,
                    std::string_view variant = "");

/// The outer diameter of a kind that is laid along a path.
double line_diameter_m(const ShapeKind& kind, const ShapeSize& size);
/// The mesh of a pipeline, cable, rope or chain along the points of its middle line. The mesh's
/// place is the first point. Throws std::invalid_argument for a kind that is not laid along a path,
/// and for fewer than two points.
ObjectMesh make_line(const ShapeKind& kind, const ShapeSize& size,
                     std::span<const Eigen::Vector3d> points);

}  // namespace ensonify::engine
