#include <ensonify/engine/seafloor/layers/area_files.h>
#include <ensonify/refine/triangle_mesh.h>

#include "fuzz/fuzz.h"

using namespace ensonify;

// GeoJSON: the polygons of an area.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto check = [](const engine::Polygon& polygon) {
    tests::promise(polygon.size() >= 3, "a polygon has three points");
    for (const Eigen::Vector2d& point : polygon)
      tests::promise(point.allFinite(), "points are finite");
  };
  engine::Heightfield grid;
  grid.world_origin = {1.0, 2.0, 0.0};
  try {
    for (const engine::PolygonWithHoles& polygon :
         engine::read_outlines(tests::file_of(data, size, "outline.geojson"), grid)) {
      check(polygon.border);
      for (const engine::Polygon& hole : polygon.holes) check(hole);
    }
  } catch (const refine::MeshError&) {
  }
  return 0;
}
