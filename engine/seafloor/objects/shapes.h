#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/random.h>
#include <ensonify/engine/seafloor/objects/shape_size.h>
#include <ensonify/engine/seafloor/objects/solids.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// A size that a shape has: its scene key, its member of ShapeSize and its usual value.
struct Dimension {
  std::string_view key;
  std::optional<double> ShapeSize::*size;
  double usual_m;
};

/// A shape known by its name.
struct ShapeKind {
  std::string_view name;
  std::string_view help;  ///< what it is, and the source of its usual size
  bool along_path;        ///< laid along a path, not set down
  std::vector<Dimension> dimensions;

  /// One size of this shape: the given one, or the usual one if that is unset.
  double size_m(const ShapeSize& given, std::optional<double> ShapeSize::*which) const;
};

const std::vector<ShapeKind>& shape_kinds();
/// By its name; - and _ are alike. Throws std::invalid_argument, with all names, for another.
const ShapeKind& shape_named(std::string_view name);
/// All dimensions, each once.
std::span<const Dimension> all_dimensions();

/// The mesh of a body, z up and y forward: closed, with normals outwards (its parts may overlap).
/// It depends on `random` only for "boulder", "net" and "debris", the shapes that draw numbers. If
/// facet_m is unset, facets are a sixteenth of the diameter (48 around the body) or as small as
/// facet_rad needs; thin rods have 8 sides. Throws std::invalid_argument for a kind that is laid
/// along a path and for sizes that contradict one another.
refine::TriangleMesh make_body(const ShapeKind& kind, const ShapeSize& size,
                               const RandomStream& random);

/// The outer diameter of a kind that is laid along a path.
double line_diameter_m(const ShapeKind& kind, const ShapeSize& size);
/// The mesh of a pipeline, cable, rope or chain along the points of its middle line. Throws
/// std::invalid_argument for a kind that is a body, and for fewer than two points.
refine::TriangleMesh make_line(const ShapeKind& kind, const ShapeSize& size,
                               std::span<const Eigen::Vector3d> points);

}  // namespace ensonify::engine
