#include <ensonify/engine/seafloor/bed/tessellate.h>

#include <cstddef>
#include <span>
#include <utility>

namespace ensonify::engine {

GridPlaces places(const Heightfield& grid) {
  GridPlaces places;
  for (int i = 0; i < grid.columns; ++i) places.x_m.push_back(static_cast<float>(grid.x_m(i)));
  for (int i = 0; i < grid.rows; ++i) places.y_m.push_back(static_cast<float>(grid.y_m(i)));
  return places;
}

refine::HeightGrid height_grid(const Heightfield& field, const std::function<void()>& stop_check) {
  GridPlaces at = places(field);
  refine::HeightGridBuilder builder(std::move(at.x_m), std::move(at.y_m), field.world_origin);
  for (int row = 0; row < field.rows; ++row) {
    if (stop_check) stop_check();
    builder.add_row(
        std::span(field.z_m).subspan(field.index(0, row), static_cast<std::size_t>(field.columns)));
  }
  return std::move(builder).finish();
}

refine::TriangleMesh tessellate(const Heightfield& field) { return height_grid(field).mesh(); }

}  // namespace ensonify::engine
