// Tests where the bins of a ping lie on the ground.

#include <cmath>
#include <numbers>

#include <ensonify/engine/mosaic/placed_side.h>
#include <ensonify/engine/mosaic/range_levels.h>
#include <ensonify/engine/sonar/echo/echo.h>

#include "support/catch.h"

using namespace ensonify::engine;
using Eigen::Vector2d;

namespace {

constexpr double height_m = 6.0;

Sonar sonar_of_20_bins() {
  Sonar sonar;
  sonar.bins = 20;
  sonar.range_m = 20.0;
  return sonar;
}

/// A ping that heads 30 degrees, at (100, 200).
MosaicPing ping() {
  return {.place_m = {100.0, 200.0}, .heading_rad = std::numbers::pi / 6.0, .height_m = height_m};
}

Vector2d starboard_m(double ground_m) {
  return Vector2d(100.0, 200.0) + ground_m * Vector2d(std::sqrt(0.75), -0.5);
}

/// What a starboard side sees over a level bed: water, seabed, shadow in bins 10 to 13, seabed, and
/// shadow from bin 17 on.
GroundLayers with_shadows() {
  GroundLayers layers;
  for (int bin = 0; bin < 20; ++bin) {
    const double r = bin + 0.5;
    const bool shadow = (bin >= 10 && bin < 14) || bin >= 17;
    const Region region = r < height_m ? Region::water_column
                          : shadow     ? Region::shadow
                                       : Region::seabed;
    layers.region.push_back(static_cast<float>(region));
    const bool lit = region == Region::seabed;
    const Vector2d place = starboard_m(std::sqrt(std::max(0.0, r * r - height_m * height_m)));
    layers.x_m.push_back(lit ? static_cast<float>(place.x()) : 0.0f);
    layers.y_m.push_back(lit ? static_cast<float>(place.y()) : 0.0f);
  }
  return layers;
}

}  // namespace

TEST_CASE("over a level bed the truth and the navigation give the same places, also of shadow") {
  const PlacedSide truth =
      place(ping(), sonar_of_20_bins(), starboard_sector, Positions::truth, with_shadows());
  const PlacedSide reported =
      place(ping(), sonar_of_20_bins(), starboard_sector, Positions::navigation, with_shadows());
  REQUIRE(truth.places_m.size() == 41);
  REQUIRE(reported.places_m.size() == 41);
  for (std::size_t bin = 6; bin < 20; ++bin) {
    CAPTURE(bin);
    CHECK(truth.shown[bin]);
    CHECK(reported.shown[bin]);
    const double r = static_cast<double>(bin) + 0.5;
    const Vector2d expected = starboard_m(std::sqrt(r * r - height_m * height_m));
    CHECK((reported.places_m[2 * bin + 1] - expected).norm() < 1e-9);
    // Shadow is interpolated over the slant range, which bends by less than 20 cm here.
    CHECK((truth.places_m[2 * bin + 1] - expected).norm() < (bin >= 10 && bin < 14 ? 0.2 : 1e-4));
  }
  for (std::size_t bin = 0; bin < 6; ++bin) CHECK_FALSE(truth.shown[bin]);
  // Both begin straight below.
  CHECK((truth.places_m[12] - Vector2d(100.0, 200.0)).norm() < 1.0);
  CHECK((reported.places_m[12] - Vector2d(100.0, 200.0)).norm() < 1e-9);
}

TEST_CASE("port lies opposite to starboard") {
  const GroundLayers layers = with_shadows();
  const PlacedSide port =
      place(ping(), sonar_of_20_bins(), port_sector, Positions::navigation, layers);
  const PlacedSide starboard =
      place(ping(), sonar_of_20_bins(), starboard_sector, Positions::navigation, layers);
  for (std::size_t i = 0; i < port.places_m.size(); ++i)
    CHECK((port.places_m[i] + starboard.places_m[i] - Vector2d(200.0, 400.0)).norm() < 1e-9);
}

TEST_CASE("a side without data has no places, and damaged places are not used") {
  GroundLayers layers = with_shadows();
  layers.x_m[8] = std::nanf("");
  layers.y_m[15] = 1e30f;
  const PlacedSide placed =
      place(ping(), sonar_of_20_bins(), starboard_sector, Positions::truth, layers);
  for (const Vector2d& at : placed.places_m) CHECK((at - Vector2d(100.0, 200.0)).norm() < 25.0);

  layers.region.assign(20, static_cast<float>(Region::no_data));
  for (const Positions positions : {Positions::truth, Positions::navigation})
    CHECK(place(ping(), sonar_of_20_bins(), starboard_sector, positions, layers).empty());
}

TEST_CASE("mean levels follow a smooth law over range, and fill what was not seen") {
  RangeLevels levels;
  const auto law = [](double ratio) { return std::pow(ratio, -3.0); };
  for (double ratio = 1.001; ratio < 10.0; ratio *= 1.001) levels.add(0, ratio, law(ratio));
  levels.finish();
  for (double ratio = 1.1; ratio < 9.0; ratio *= 1.03)
    CHECK(levels.mean(0, ratio) == Approx(law(ratio)).epsilon(0.005));
  CHECK(levels.mean(0, 500.0) == Approx(law(10.0)).epsilon(0.1));
  CHECK(levels.mean(0, INFINITY) == levels.mean(0, 500.0));
  CHECK(levels.mean(1, 2.0) == 1.0);
}
