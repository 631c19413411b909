#pragma once

#include <functional>

#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/refine/height_grid.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// The surface with these heights, with the faces that HeightGrid defines. Throws refine::MeshError
/// if no cell is whole, or a position does not fit its type. `stop_check` is called for each row;
/// it may throw to end the work.
refine::HeightGrid height_grid(const Heightfield& field,
                               const std::function<void()>& stop_check = {});

/// The mesh of height_grid(). Throws as height_grid().
refine::TriangleMesh tessellate(const Heightfield& field);

}  // namespace ensonify::engine
