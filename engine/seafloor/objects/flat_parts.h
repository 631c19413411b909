#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/object_mesh.h>

namespace ensonify::engine {

/// A flat part of a body's surface: faces that join in one plane. It is described as the rectangle
/// that has the faces' area and second moments, or as the ellipse that has the faces' area and the
/// rectangle's ratio of sides. A flat part with a hole or a bay cannot be described as a rectangle,
/// so it is cut into pieces, which are flat parts too.
struct FlatPart {
  Eigen::Vector3d middle;
  Eigen::Vector3f normal;         ///< unit, out of the body
  Eigen::Vector3f along, across;  ///< unit, the principal axes
  float length_m, width_m;        ///< along these axes; their product is the area
  /// If the part approximates a curved surface: by how much the normal of this surface turns along
  /// each axis, from end to end of the part. Otherwise 0.
  float bend_along_rad = 0.0f, bend_across_rad = 0.0f;
  std::uint32_t first_facet = 0, facets = 0;  ///< of the curved surface; no facets if there is none
  bool round = false;                         ///< nearer to an ellipse than to a rectangle
  bool piece = false;     ///< a piece of a flat part that was cut; all pieces have one `surface`
  std::uint32_t surface;  ///< number of the smooth surface, equal for parts without an edge between
};

/// A corner of facets of a curved surface.
struct FacetCorner {
  Eigen::Vector3d place;
  Eigen::Vector3f normal;  ///< unit, normal of the surface
  float per_m2 = 0.0f;     ///< Gaussian curvature of the surface, if the facets are triangles
};

/// A facet of a curved surface. It is the triangle of the first three corners, which neighbours
/// share, or a strip of a surface that is straight in one direction, such as a cylinder or a cone.
/// The straight sides of a strip are from corner 0 to 1 and from 2 to 3; each side has one normal.
struct CurvedFacet {
  std::array<std::uint32_t, 4> corners;
  bool strip;
};

/// The facets of a body's curved surfaces, in the order of its flat parts.
struct CurvedFacets {
  std::vector<FacetCorner> corners;
  std::vector<CurvedFacet> facets;

  std::span<const CurvedFacet> of(const FlatPart& flat_part) const {
    return std::span(facets).subspan(flat_part.first_facet, flat_part.facets);
  }
};

/// The flat parts of a body, and the pieces of the flat parts that were cut.
struct FlatParts {
  std::vector<FlatPart> whole;
  std::map<std::size_t, std::vector<FlatPart>> pieces;  ///< by number of the part in `whole`
  CurvedFacets curved;

  /// All flat parts in their order, with pieces in place of the flat parts that were cut.
  std::vector<FlatPart> in_pieces() &&;
};

/// The flat parts of a mesh, in its own frame. Vertices at one place count as one. Edges sharper
/// than sharpest_rad (facets.h) are real edges. `stop_check` is called from time to time.
FlatParts flat_parts_of(const ObjectMesh& mesh, const std::function<void()>& stop_check = {});

}  // namespace ensonify::engine
