#include <ensonify/engine/trace/nearest_floats.h>

namespace ensonify::engine {

Eigen::Vector3d nearest_floats(const Eigen::Vector3d& place) {
  // Volatile, because GCC 12 drops the rounding to float and back when it joins several
  // neighbouring doubles in one vector register (at -O2 and above).
  const auto rounded = [](double x) {
    const volatile float nearest = static_cast<float>(x);
    return static_cast<double>(nearest);
  };
  return {rounded(place.x()), rounded(place.y()), rounded(place.z())};
}

}  // namespace ensonify::engine
