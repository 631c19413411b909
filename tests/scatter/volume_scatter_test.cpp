#include <cmath>
#include <limits>

#include "support/catch.h"

#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/volume_scatter.h>

using namespace ensonify::scatter;

namespace {

const InsonifiedWater water = {
    .solid_angle_sr = 0.01, .pulse_s = 1e-4, .sound_speed_mps = 1500.0, .strength_db = -75.0};

}  // namespace

TEST_CASE("The insonified volume is a slice of a sphere, half the pulse thick") {
  // 0.01 sr x (100 m)^2 x 7.5 cm
  CHECK(insonified_volume_m3(water, 100.0) == Approx(7.5));
  InsonifiedWater sphere = water;
  sphere.solid_angle_sr = 4.0 * 3.14159265358979;
  // The slices of a train of pulses fill the sphere.
  double sum = 0.0;
  for (int i = 0; i < 1000; ++i) sum += insonified_volume_m3(sphere, 0.075 * (i + 0.5));
  CHECK(sum == Approx(4.0 / 3.0 * 3.14159265358979 * std::pow(75.0, 3)).epsilon(1e-5));
}

TEST_CASE("Volume reverberation follows the sonar equation") {
  // 220 - 80 - 4 - 75 + 10 lg 7.5
  CHECK(volume_reverberation_db(water, 220.0, 0.02, 100.0) == Approx(61.0 + to_db(7.5)));
}

TEST_CASE("Without absorption volume reverberation falls by 20 dB per decade of range") {
  CHECK(volume_reverberation_db(water, 220.0, 0.0, 10.0) -
            volume_reverberation_db(water, 220.0, 0.0, 100.0) ==
        Approx(20.0));
}

TEST_CASE("Doubling the pulse or the beam doubles the echo") {
  const double before = volume_reverberation_db(water, 220.0, 0.03, 60.0);
  InsonifiedWater longer = water, wider = water;
  longer.pulse_s *= 2.0;
  wider.solid_angle_sr *= 2.0;
  CHECK(volume_reverberation_db(longer, 220.0, 0.03, 60.0) - before == Approx(to_db(2.0)));
  CHECK(volume_reverberation_db(wider, 220.0, 0.03, 60.0) - before == Approx(to_db(2.0)));
}

TEST_CASE("Invalid volumes are refused") {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {0.0, -1.0, nan, std::numeric_limits<double>::infinity()}) {
    CHECK_THROWS_AS(insonified_volume_m3(water, bad), std::invalid_argument);
    for (double InsonifiedWater::*member :
         {&InsonifiedWater::solid_angle_sr, &InsonifiedWater::pulse_s,
          &InsonifiedWater::sound_speed_mps}) {
      InsonifiedWater broken = water;
      broken.*member = bad;
      CHECK_THROWS_AS(volume_reverberation_db(broken, 220.0, 0.0, 10.0), std::invalid_argument);
    }
  }
}
