// The gamma distributions of a ground's patches.

#include <cmath>

#include "support/catch.h"

#include <ensonify/scatter/angle.h>
#include <ensonify/scatter/ground_texture.h>

using namespace ensonify::scatter;

namespace {

/// Share of random numbers that take a column.
double width_of(int column) {
  return std::ldexp(1.0 / GammaTable::columns_per_octave,
                    column / GammaTable::columns_per_octave - GammaTable::octaves);
}

}  // namespace

TEST_CASE("each row of quantiles has the mean 1 and the variance of its gamma distribution") {
  const GammaTable table;
  for (const double shape : {0.02, 0.1, 0.5, 1.0, 3.0, 20.0}) {
    const int row = GammaTable::row_of(std::log2(shape));
    const double its_shape =
        std::exp2(GammaTable::lowest_log2 + double(row) / GammaTable::rows_per_octave);
    CHECK(its_shape == Approx(shape).epsilon(0.045));
    double mean = 0.0, square = 0.0;
    for (int column = 0; column < GammaTable::columns; ++column) {
      const double value = table.value(row, column);
      // The first column has all shares below it too.
      const double share = column == 0 ? std::ldexp(17.0 / 16.0, -16) : width_of(column);
      mean += share * value;
      square += share * value * value;
    }
    CAPTURE(shape);
    CHECK(mean == Approx(1.0).epsilon(1e-5));
    CHECK(square - 1.0 == Approx(1.0 / its_shape).epsilon(0.02));
  }
  for (int column = 0; column < GammaTable::columns; ++column)
    CHECK(table.value(GammaTable::rows - 1, column) == 1.0f);
}

TEST_CASE("quantiles of the shape 1 are those of the exponential distribution") {
  const GammaTable table;
  const int row = GammaTable::row_of(0.0);
  for (int column = 16; column < GammaTable::columns; column += 7) {
    const double low = std::ldexp(1.0 + (column % 16) / 16.0, column / 16 - 16);
    const double high = low + width_of(column);
    CHECK(GammaTable::column_of(static_cast<float>(low)) == column);
    CHECK(GammaTable::column_of(static_cast<float>(0.99 * high + 0.01 * low)) == column);
    CHECK(table.value(row, column) <= -std::log(low) + 0.01);
    CHECK(table.value(row, column) >= -std::log(high) - 0.01);
  }
}

TEST_CASE("a bed is patchier at low grazing angles, and its stones stand out more") {
  const GroundTexture sand = ground_texture_of(sediment_named("medium sand"));
  CHECK(sand.shape_at(10.0 * degree) == Approx(sand.shape));
  CHECK(sand.shape_at(30.0 * degree) ==
        Approx(sand.shape * std::pow(0.5 / std::sin(10.0 * degree), sand.exponent)));
  CHECK(sand.shape_at(0.0) == sand.shape_at(5.0 * degree));
  CHECK(sand.glint_share_at(10.0 * degree) == Approx(sand.glint_share));
  CHECK(sand.glint_share_at(40.0 * degree) < 0.1 * sand.glint_share);
  CHECK(ground_texture_of(sediment_named("clay")).shape > sand.shape);
  CHECK(ground_texture_of(sediment_named("rock")).shape < sand.shape);
  CHECK(GroundTexture().even());
}
