#pragma once

#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// Two triangles for every cell that has all four heights, row by row from the south-west, split
/// along the diagonal that is shorter in space (the south-west one in a tie), counter-clockwise
/// seen from above. Vertices are the used grid points in row order. Throws refine::MeshError if no
/// cell is whole, or a position does not fit its type.
refine::TriangleMesh tessellate(const Heightfield& field);

}  // namespace ensonify::engine
