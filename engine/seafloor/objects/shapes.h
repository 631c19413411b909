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

/// A size that a shape has: its key, where it is kept, and the usual one.
struct Dimension {
  std::string_view key;
  std::optional<double> ShapeSize::*size;
  double usual_m;
};

/// A shape known by its name.
struct ShapeKind {
  std::string_view name;
  std::string_view help;  ///< what it is, and where its usual size comes from
  bool along_path;        ///< laid along a path rather than set down
  std::vector<Dimension> dimensions;

  /// A size it has: as given, or the usual.
  double size_m(const ShapeSize& given, std::optional<double> ShapeSize::*which) const;
};

const std::vector<ShapeKind>& shape_kinds();
/// Throws std::invalid_argument for a name that is not one of shape_kinds().
const ShapeKind& shape_named(std::string_view name);
/// Every dimension there is, once.
std::span<const Dimension> all_dimensions();

/// A body's mesh, z up and y forward: closed and turned outwards (parts of it may overlap), the
/// same for the same numbers of the stream; only "boulder", "net" and "debris" draw any. facet_m
/// unset: a sixteenth of its diameter (48 facets round) or what facet_rad asks for, thin rods
/// having 8 sides. Throws std::invalid_argument for a kind that is laid along a path and for sizes
/// that contradict one another.
refine::TriangleMesh make_body(const ShapeKind& kind, const ShapeSize& size,
                               const RandomStream& random);

/// How wide a kind is that is laid along a path.
double line_diameter_m(const ShapeKind& kind, const ShapeSize& size);
/// A pipeline, cable, rope or chain along the points of its middle line. Throws
/// std::invalid_argument for a kind that is a body, and for fewer than two points.
refine::TriangleMesh make_line(const ShapeKind& kind, const ShapeSize& size,
                               std::span<const Eigen::Vector3d> points);

}  // namespace ensonify::engine
