#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace ensonify::engine {

/// Where the element of a sector looks. Angles are depressions: pi / 2 is straight down.
struct Element {
  double axis_rad = 0.0;
  double low_rad = 0.0, high_rad = 0.0;  ///< where the fan begins and ends
  bool operator==(const Element&) const = default;
};

/// One transmission of a sonar and what receives it: a fan to one side of the array.
struct Sector {
  std::string_view name;  ///< in files and tables
  /// 1: the fan looks to the starboard of the array; -1: to its port, so that it is left-handed.
  double out = 1.0;
  /// Selects the sector's random numbers and vertical pattern. It is less than most_sectors,
  /// different for each sector of a sonar, and does not depend on which other sectors the sonar
  /// has. The sectors 2 n and 2 n + 1 are a pair.
  std::size_t number = 0;
  /// Unset for a side: the keys of the sonar define its fan. If set, the sonar's vertical pattern
  /// is turned to the axis of this element.
  std::optional<Element> element = {};
};

/// The index of the sector with this name; none if no sector has this name.
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
