#pragma once

#include <string>
#include <string_view>

#include <Eigen/Core>

namespace ensonify::engine {

/// Whether a place on Earth can have this latitude and longitude.
bool is_on_earth(double latitude_deg, double longitude_deg);

/// For impossible_value(): the text for a place that is not on Earth, and the text of its values.
inline constexpr std::string_view impossible_place = "latitude or longitude; it is left out";
std::string place_text(double latitude_deg, double longitude_deg);

/// Metres per radian of longitude and metres per radian of latitude at this latitude, on WGS 84. It
/// needs no GeographicLib and takes any number, because builds without GeographicLib read
/// recordings, and damaged pings have impossible places. (tangent_place() would need it and throw.)
Eigen::Vector2d metres_per_radian(double latitude_rad);

}  // namespace ensonify::engine
