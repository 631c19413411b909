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

/// A mesh with the numbers of its places, flat parts and surfaces, for curved_facets().
struct FacesInParts {
  const ObjectMesh& mesh;
  std::span<const std::uint32_t> place;    ///< per vertex; equal for vertices at one place
  std::span<const std::uint32_t> part;     ///< flat part, per face; none if the face has no area
  std::span<const std::uint32_t> surface;  ///< smooth surface, per face
  static constexpr std::uint32_t none = ~std::uint32_t{0};
};

/// The facets of the curved surfaces that flat parts approximate. Writes first_facet, facets and
/// the bends of the flat parts.
///
/// Where a smooth surface continues behind an edge, the normal at the edge is between the normals
/// of the two flat parts. There is one exception. A flat part of several faces that is more than
/// three times as long across the edge as its neighbour is straight up to the edge. Examples are
/// the sides of a box with rounded edges, and of a cylinder with round ends. The normals at the
/// corners of triangles follow Max (J. Graphics Tools 4, 1, 1999), which is exact for vertices on a
/// sphere. At a corner of a straight part, only the faces of straight parts count for the normal.
/// Other normals, and the curvatures, are moved towards the normals and curvatures of a quadric
/// through the vertices around the corner, if the vertices lie close to a quadric.
CurvedFacets curved_facets(const FacesInParts& faces, std::vector<BentEdge> edges,
                           std::span<FlatPart> flat_parts, const std::function<void()>& stop_check);

}  // namespace ensonify::engine
