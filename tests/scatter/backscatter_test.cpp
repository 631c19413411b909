#include <cmath>
#include <numbers>

#include "support/catch.h"

#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify::scatter;

TEST_CASE("Lambert's law is mu at vertical and falls by 6.02 dB where the sine has halved") {
  const Lambert bed(-27.0);
  CHECK(to_db(bed.cross_section(std::numbers::pi / 2)) == Approx(-27.0));
  CHECK(to_db(bed.cross_section(std::numbers::pi / 6)) == Approx(-33.0206));
  CHECK(bed.cross_section(0.0) == 0.0);
}

TEST_CASE("a bed that would scatter more than it receives is refused") {
  CHECK_THROWS_AS(Lambert(-4.9), std::invalid_argument);
  CHECK_THROWS_AS(Lambert(std::nan("")), std::invalid_argument);
  CHECK_NOTHROW(Lambert(-4.98));
}

namespace {
// Steep near vertical and rich at grazing, as real beds are.
struct Steep final : Backscatter {
  double cross_section(double grazing_rad) const override {
    const double s = std::sin(grazing_rad), off = grazing_rad - std::numbers::pi / 2;
    return 1e-3 * s * s + std::exp(-off * off / (2 * 0.05 * 0.05));
  }
};
}  // namespace

TEST_CASE("the table gives the model over the sine within 0.01 dB at any angle") {
  const Lambert lambert(-27.0);
  const Steep steep;
  for (const Backscatter* model :
       {static_cast<const Backscatter*>(&lambert), static_cast<const Backscatter*>(&steep)}) {
    const BackscatterTable table(*model);
    for (double degrees = 0.1; degrees <= 90.0; degrees += 0.0173) {
      const double grazing = degrees * std::numbers::pi / 180.0;
      CAPTURE(degrees);
      REQUIRE(std::abs(to_db(table.over_sine(std::sin(grazing)) * std::sin(grazing) /
                             model->cross_section(grazing))) < 0.01);
    }
    CHECK(std::isfinite(table.over_sine(0.0)));
    CHECK(table.over_sine(1.0) == Approx(model->cross_section(std::numbers::pi / 2)));
  }
}

TEST_CASE("decibels and ratios undo each other") {
  for (const double db : {-200.0, -3.0, 0.0, 210.0})
    CHECK(to_db(from_db(db)) == Approx(db).margin(1e-12));
}
