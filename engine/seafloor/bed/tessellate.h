#pragma once

#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// Two triangles for every cell that has all four heights, row by row from the south-west,
/// counter-clockwise seen from above. A cell is split along the diagonal that is shorter in space;
/// if both are equal, along the one from the south-west corner. Vertices are the used grid points
/// in row order. Throws refine::MeshError if no cell is whole, or a position does not fit its type.
refine::TriangleMesh tessellate(const Heightfield& field);

}  // namespace ensonify::engine
