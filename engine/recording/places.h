#pragma once

#include <string>
#include <string_view>

#include <Eigen/Core>

namespace ensonify::engine {

/// Whether a place on Earth can have this latitude and longitude.
bool is_on_earth(double latitude_deg, double longitude_deg);

/// For impossible_value(): one that is_on_earth() denies, and its value.
inline constexpr std::string_view impossible_place = "latitude or longitude; it is left out";
std::string place_text(double latitude_deg, double longitude_deg);

/// Metres per radian of longitude and of latitude about a place, WGS 84. Not tangent_place(): it
/// needs GeographicLib, without which recordings are read too, and refuses the impossible places
/// of damaged pings.
Eigen::Vector2d metres_per_radian(double latitude_rad);

}  // namespace ensonify::engine
