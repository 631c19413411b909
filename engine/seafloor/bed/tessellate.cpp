#include <ensonify/engine/seafloor/bed/tessellate.h>

#include <cstddef>
#include <span>
#include <utility>

namespace ensonify::engine {

refine::HeightGrid height_grid(const Heightfield& field, const std::function<void()>& stop_check) {
  std::vector<float> x_m, y_m;
  for (int i = 0; i < field.columns; ++i) x_m.push_back(static_cast<float>(field.x_m(i)));
  for (int i = 0; i < field.rows; ++i) y_m.push_back(static_cast<float>(field.y_m(i)));
  refine::HeightGridBuilder builder(std::move(x_m), std::move(y_m), field.world_origin);
  for (int row = 0; row < field.rows; ++row) {
    if (stop_check) stop_check();
    builder.add_row(
        std::span(field.z_m).subspan(field.index(0, row), static_cast<std::size_t>(field.columns)));
  }
  return std::move(builder).finish();
}

refine::TriangleMesh tessellate(const Heightfield& field) { return height_grid(field).mesh(); }

}  // namespace ensonify::engine
