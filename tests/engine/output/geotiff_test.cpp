#include <ensonify/engine/output/geotiff.h>

#include <cmath>
#include <fstream>

#include <ensonify/engine/seafloor/bed/survey.h>

#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace ensonify::engine;
using namespace ensonify::tests;

TEST_CASE("A heightfield written as GeoTIFF reads back: heights, holes, north and world origin") {
  const TemporaryFolder folder;
  Heightfield field;
  field.columns = 4;
  field.rows = 3;
  field.cell_east_m = 0.5;
  field.cell_north_m = 0.25;
  field.world_origin = {500001.0, 4000000.5, 2.0};
  field.z_m = {-9, -10, -11, -12.5, -5, -6, std::nan(""), -8, -1, -2, -3, -4};
  const std::vector<std::byte> bytes = encode_geotiff(field);
  CHECK(bytes == encode_geotiff(field));
  std::ofstream(folder / "again.tif", std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
  const Heightfield again = read_survey(folder / "again.tif", 2.0);
  CHECK(again.columns == 4);
  CHECK(again.rows == 3);
  CHECK(again.cell_east_m == field.cell_east_m);
  CHECK(again.cell_north_m == field.cell_north_m);
  CHECK(again.world_origin == field.world_origin);
  for (std::size_t i = 0; i < field.z_m.size(); ++i) {
    CHECK(std::isnan(again.z_m[i]) == std::isnan(field.z_m[i]));
    if (!std::isnan(field.z_m[i])) CHECK(again.z_m[i] == field.z_m[i]);
  }
}
