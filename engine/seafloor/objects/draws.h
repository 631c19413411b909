#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include <Eigen/Core>

#include <ensonify/engine/base/random.h>

namespace ensonify::engine {

/// Draws the numbers of a random stream one after another. Draw at most one number in the arguments
/// of a call, because the compiler chooses the order of the arguments.
class Draws {
 public:
  explicit Draws(const RandomStream& stream) : stream_(stream) {}
  double between(double low, double high) {
    double drawn = 0.0;
    stream_.uniform({&drawn, 1}, next_++);
    return low + (high - low) * drawn;
  }
  /// True with this probability.
  bool chance(double share) { return between(0.0, 1.0) <= share; }
  /// -1 or 1.
  double side() { return chance(0.5) ? -1.0 : 1.0; }
  /// A whole number from 0 to count - 1.
  int one_of(int count) { return std::min(static_cast<int>(between(0.0, count)), count - 1); }
  Eigen::Vector3d direction() {
    const double z = between(-1.0, 1.0), angle = between(0.0, 2.0 * std::numbers::pi),
                 r = std::sqrt(1.0 - z * z);
    return {r * std::cos(angle), r * std::sin(angle), z};
  }

 private:
  const RandomStream& stream_;
  std::uint64_t next_ = 0;
};

}  // namespace ensonify::engine
