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
  double usual_m;      ///< its usual value; 0: it follows from the other sizes
  double max_m = 0.0;  ///< of a family, the greatest value that is drawn; usual_m is the least
};

/// A part of a shape.
struct ShapePart {
  std::string_view name;
  std::string_view material;  ///< of this part; empty: the object's
};

struct FamilyForm;

/// A shape known by its name. A family is a shape whose form is drawn; it has parts.
struct ShapeKind {
  std::string_view name;
  std::string_view help;  ///< what it is, and the source of its usual size
  bool along_path;        ///< laid along a path, not set down
  std::vector<Dimension> dimensions;
  std::vector<ShapePart> parts = {};
  std::vector<std::string_view> variants = {};  ///< words for the key `variant`
  void (*family)(FamilyForm&) = nullptr;        ///< makes a member
  /// Whether a member is several things that each lie in the bed: a burial sinks all of them more.
  bool several = false;

  /// One size of this shape: the given one, or the usual one if that is unset.
  double size_m(const ShapeSize& given, std::optional<double> ShapeSize::*which) const;
};

/// What a shape is made of.
struct ShapeBody {
  refine::TriangleMesh mesh;
  std::vector<std::uint8_t> face_part;  ///< number in ShapeKind::parts; empty: all 0
  double sunk_m = 0.0;  ///< how far its lowest point lies below the bed, as the shape is meant
};

const std::vector<ShapeKind>& shape_kinds();
/// By its name; - and _ are alike. Throws std::invalid_argument, with all names, for another.
const ShapeKind& shape_named(std::string_view name);
/// All dimensions, each once.
std::span<const Dimension> all_dimensions();

/// The mesh of a body, z up and y forward: closed, with normals outwards (its parts may overlap).
/// It depends on `random` for families and for "boulder", "net" and "debris". A family has exactly
/// the given sizes; of those that are unset, the first is drawn and the others follow from the
/// form. If `variant` is empty, it is drawn. If facet_m is unset, facets are a sixteenth of the
/// diameter (48 around the body) or as small as facet_rad needs; thin rods have 8 sides. Throws
/// std::invalid_argument for a kind that is laid along a path, a variant that the kind does not
/// have, and sizes that contradict one another.
ShapeBody make_body(const ShapeKind& kind, const ShapeSize& size, const RandomStream& random,
                    std::string_view variant = "");

/// The outer diameter of a kind that is laid along a path.
double line_diameter_m(const ShapeKind& kind, const ShapeSize& size);
/// The mesh of a pipeline, cable, rope or chain along the points of its middle line, with its place
/// at the first of them. Throws
/// std::invalid_argument for a kind that is a body, and for fewer than two points.
ObjectMesh make_line(const ShapeKind& kind, const ShapeSize& size,
                     std::span<const Eigen::Vector3d> points);

}  // namespace ensonify::engine
