#pragma once

#include <cstdint>

namespace ensonify::engine {

/// How much of an object a sonar sees, as solid angles of rays summed over all pings: `alone` of
/// the rays that would meet the object if it was alone in the water, and `seen` of the rays that
/// meet it in the scene. Parts that the bed buries, or that something in front hides, are not seen.
struct ObjectVisibility {
  std::uint64_t alone = 0, seen = 0;  ///< in 2^-44 sr: whole numbers, whose sum has no order

  ObjectVisibility& operator+=(const ObjectVisibility& other) {
    return *this = {alone + other.alone, seen + other.seen};
  }
  ObjectVisibility operator-(const ObjectVisibility& other) const {
    return {alone - other.alone, seen - other.seen};
  }
  /// seen / alone; NaN for an object that no ray could have met.
  double share() const { return static_cast<double>(seen) / static_cast<double>(alone); }
};

}  // namespace ensonify::engine
