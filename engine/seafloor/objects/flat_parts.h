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
/// that has their area and second moments, or as the ellipse that has their area and the
/// rectangle's ratio of sides. One with a hole or a bay, for which no rectangle can stand, is cut
/// into pieces that are such parts.
struct FlatPart {
  Eigen::Vector3d middle;
  Eigen::Vector3f normal;         ///< unit, out of the body
  Eigen::Vector3f along, across;  ///< unit, its principal axes
  float length_m, width_m;        ///< along them; their product is the area
  /// By how much the normal of the curved surface that it stands for turns over it, in these
  /// directions; 0 if it is flat.
  float bend_along_rad, bend_across_rad;
  std::uint32_t first_facet, facets;  ///< of a curved surface; no facets if it is flat
  bool round;                         ///< nearer to an ellipse than to a rectangle
  bool piece;             ///< of a flat part that was cut; the others have the same `surface`
  std::uint32_t surface;  ///< parts that join without a real edge have the same number
};

/// A corner of a curved surface's facets, with the normal of the surface there and, of triangles,
/// its Gaussian curvature.
struct FacetCorner {
  Eigen::Vector3d place;
  Eigen::Vector3f normal;  ///< unit
  float per_m2 = 0.0f;
};

/// A facet of a curved surface: the triangle of the first three corners, which neighbours share, or
/// a strip of a surface that is straight in one direction, as that of a cylinder or a cone. Its
/// straight sides go from corner 0 to 1 and from 2 to 3; a side has one normal.
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

/// The flat parts of a body, and the pieces of those that were cut.
struct FlatParts {
  std::vector<FlatPart> whole;
  std::map<std::size_t, std::vector<FlatPart>> pieces;  ///< by the number in `whole`
  CurvedFacets curved;

  /// All in their order, with the pieces of a flat part in its place.
  std::vector<FlatPart> in_pieces() &&;
};

/// The flat parts of a mesh, in its own frame. Vertices at one place count as one. Edges sharper
/// than 40 degrees are real ones, as in facet_angle_rad(). `stop_check` is called now and then.
FlatParts flat_parts_of(const ObjectMesh& mesh, const std::function<void()>& stop_check = {});

}  // namespace ensonify::engine
