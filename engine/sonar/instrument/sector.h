#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace ensonify::engine {

/// Where the element of a sector looks: depressions; pi / 2 is straight down.
struct Element {
  double axis_rad = 0.0;
  double low_rad = 0.0, high_rad = 0.0;  ///< ends of the fan
  bool operator==(const Element&) const = default;
};

/// One transmission of a sonar and what receives it: a fan to one side of the array.
struct Sector {
  std::string_view name;  ///< in files and tables
  /// 1: the fan looks to the starboard of the array; -1: to its port, so that it is left-handed.
  double out = 1.0;
  /// What its random numbers and its vertical pattern belong to: less than most_sectors, the same
  /// whatever other sectors the sonar has, and different from theirs. 2 n and 2 n + 1 are a pair.
  std::size_t number = 0;
  /// Unset: as the keys of the sonar have it, for a side. Otherwise the sonar's vertical pattern is
  /// turned to this axis.
  std::optional<Element> element = {};
};

/// The place of the sector with this name; none if there is none.
constexpr std::optional<std::size_t> place_of(std::span<const Sector> sectors,
                                              std::string_view name) {
  for (std::size_t i = 0; i < sectors.size(); ++i)
    if (sectors[i].name == name) return i;
  return std::nullopt;
}

/// The most sectors of a sonar.
inline constexpr std::size_t most_sectors = 4;

/// The sectors of a sidescan sonar, in the order of its lines.
inline constexpr Sector port_sector{"port", -1.0, 0}, starboard_sector{"starboard", 1.0, 1};
inline constexpr std::array sidescan_sectors{port_sector, starboard_sector};

/// The sector of an imaging sonar. Its array lies across the direction in which it looks.
inline constexpr std::array imaging_sectors{Sector{"ahead", 1.0, 0}};

/// The sides of a sidescan sonar, as scenes and recordings name them.
enum class Side { port, starboard };
constexpr std::string_view name_of(Side side) {
  return sidescan_sectors[static_cast<std::size_t>(side)].name;
}

/// The sectors that a sonar may have together.
enum class Sides { both, port, starboard };
struct SidesKind {
  std::string_view name;  ///< in scenes
  std::span<const Sector> sectors;
};
/// In the order of Sides.
inline constexpr std::array sides_kinds{
    SidesKind{"both", sidescan_sectors},
    SidesKind{"port", std::span(sidescan_sectors).first(1)},
    SidesKind{"starboard", std::span(sidescan_sectors).last(1)},
};
constexpr std::string_view name_of(Sides sides) {
  return sides_kinds[static_cast<std::size_t>(sides)].name;
}
constexpr std::span<const Sector> sectors_of(Sides sides) {
  return sides_kinds[static_cast<std::size_t>(sides)].sectors;
}

}  // namespace ensonify::engine
