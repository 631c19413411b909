#include <ensonify/engine/trace/nearest_floats.h>

#include <cmath>

#include "support/catch.h"
#include "support/meshes.h"

using namespace ensonify;

TEST_CASE("A place's nearest floats are floats, and no others are nearer") {
  tests::Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const double size = tests::uniform(random, 1.0, 1e6);
    const Eigen::Vector3d place = size * tests::direction(random);
    // A fan's origin is also computed, rounded and used immediately.
    const Eigen::Vector3d found =
        engine::nearest_floats(place + Eigen::Vector3d(0.123, 0.456, 0.1));
    for (int axis = 0; axis < 3; ++axis) {
      const volatile float stored = static_cast<float>(found[axis]);
      CHECK(static_cast<double>(stored) == found[axis]);
      const double off = std::abs(found[axis] - (place + Eigen::Vector3d(0.123, 0.456, 0.1))[axis]);
      for (const float end : {-1e30f, 1e30f})
        CHECK(off <= std::abs(static_cast<double>(std::nextafter(stored, end)) - found[axis]));
    }
  }
}
