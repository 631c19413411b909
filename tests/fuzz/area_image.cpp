#include <ensonify/engine/seafloor/layers/area_files.h>
#include <ensonify/refine/triangle_mesh.h>

#include "fuzz/fuzz.h"

using namespace ensonify;

// The image of an area, over a bed of 3 m by 2 m.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const engine::Heightfield grid{
      .columns = 4, .rows = 3, .cell_east_m = 1.0, .cell_north_m = 1.0, .z_m = {}};
  try {
    const engine::AreaImage image =
        engine::read_area_image(tests::file_of(data, size, "area"), grid, 1);
    for (const double x_m : {-1.5, 0.1, 1e9})
      for (const double y_m : {-1e300, 0.1, 1.0}) static_cast<void>(image.holds({x_m, y_m}));
  } catch (const refine::MeshError&) {
  }
  return 0;
}
