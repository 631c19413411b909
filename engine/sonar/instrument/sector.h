#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace ensonify::engine {

/// One transmission of a sonar and what receives it: a fan to one side of the array.
struct Sector {
  std::string_view name;  ///< in files and tables
  /// 1: the fan looks to the starboard of the array; -1: to its port, so that it is left-handed.
  double out = 1.0;
  /// What its random numbers and its vertical pattern belong to. It is the same whatever other
  /// sectors the sonar has, and differs from theirs.
  std::size_t number = 0;
};

/// The most sectors of a sonar.
inline constexpr std::size_t most_sectors = 4;

/// The sectors of a sidescan sonar, in the order of its lines.
inline constexpr Sector port_sector{"port", -1.0, 0}, starboard_sector{"starboard", 1.0, 1};
inline constexpr std::array sidescan_sectors{port_sector, starboard_sector};

/// The sides of a sidescan sonar, as scenes and recordings name them.
enum class Side { port, starboard };
enum class Sides { both, port, starboard };

constexpr std::string_view name_of(Side side) {
  return sidescan_sectors[static_cast<std::size_t>(side)].name;
}
constexpr std::string_view name_of(Sides sides) {
  return sides == Sides::both ? "both"
                              : name_of(sides == Sides::port ? Side::port : Side::starboard);
}

constexpr std::span<const Sector> sectors_of(Sides sides) {
  const std::span all(sidescan_sectors);
  switch (sides) {
    case Sides::both: break;
    case Sides::port: return all.first(1);
    case Sides::starboard: return all.last(1);
  }
  return all;
}

}  // namespace ensonify::engine
