#pragma once

#include <cstdint>

namespace ensonify::engine {

/// How much of an object a sonar sees: the solid angles, summed over all pings, of the rays that
/// would meet it if it were alone in the water, and of those among them that meet it in the scene.
/// The part that the bed buries and the part that something in front hides are not seen.
struct ObjectVisibility {
  std::uint64_t alone = 0, seen = 0;  ///< in 2^-44 sr: whole numbers, whose sum has no order

  ObjectVisibility& operator+=(const ObjectVisibility& other);
  ObjectVisibility operator-(const ObjectVisibility& other) const {
    return {alone - other.alone, seen - other.seen};
  }
  /// seen / alone; NaN for an object that no ray could have met.
  double share() const { return static_cast<double>(seen) / static_cast<double>(alone); }
};

}  // namespace ensonify::engine
