#pragma once

#include <functional>
#include <vector>

#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/refine/height_grid.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// Where the columns and the rows of a grid lie.
struct GridPlaces {
  std::vector<float> x_m, y_m;
};
GridPlaces places(const Heightfield& grid);

/// The surface over these heights; its faces are those that HeightGrid defines. Throws
/// refine::MeshError if no cell is whole, or a position does not fit its type. `stop_check` is
/// called for each row; what it throws ends the work.
refine::HeightGrid height_grid(const Heightfield& field,
                               const std::function<void()>& stop_check = {});

/// Its faces. Throws as height_grid() does.
refine::TriangleMesh tessellate(const Heightfield& field);

}  // namespace ensonify::engine
