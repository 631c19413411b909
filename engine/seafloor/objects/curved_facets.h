#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include <ensonify/engine/seafloor/object_mesh.h>
#include <ensonify/engine/seafloor/objects/flat_parts.h>

namespace ensonify::engine {

/// An edge between faces of different flat parts where a surface is smooth.
struct BentEdge {
  std::uint32_t from, to;  ///< vertices
  std::uint32_t face, other;
};

/// What a mesh is made of, for curved_facets().
struct FacesInParts {
  const ObjectMesh& mesh;
  std::span<const std::uint32_t> place;    ///< of a vertex: the same number for those at one place
  std::span<const std::uint32_t> part;     ///< of a face; none if it has no area
  std::span<const std::uint32_t> surface;  ///< smooth, of a face
  static constexpr std::uint32_t none = ~std::uint32_t{0};
};

/// The facets of the curved surfaces that flat parts stand for. Writes their numbers and the bends
/// into the flat parts.
///
/// Where a surface goes on behind an edge, its normal there lies between those of both flat parts.
/// But a flat part of several faces that is three times as long across an edge as its neighbour is
/// straight up to there: the side of a box with rounded edges, a cylinder with round ends. The
/// normals at the corners of triangles are those by Max (J. Graphics Tools 4, 1, 1999), which are
/// exact for vertices on a sphere, or those of what is straight there. They and the curvatures are
/// moved to those of the quadric through the vertices around, as far as these lie on one.
CurvedFacets curved_facets(const FacesInParts& faces, std::vector<BentEdge> edges,
                           std::span<FlatPart> flat_parts, const std::function<void()>& stop_check);

}  // namespace ensonify::engine
