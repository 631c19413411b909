#pragma once

#include <functional>
#include <string>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/bed/geographic.h>

namespace ensonify::engine {

using PlaceOfMap = std::function<PlaceOnEarth(const Eigen::Vector2d& place)>;

/// From the metres east and north of a coordinate reference system, given as WKT, to places on WGS
/// 84; empty if the text is, or if the system has no such places. For one thread at a time. Throws
/// std::invalid_argument for a place that is off the system's map, and in a build without
/// GeographicLib.
PlaceOfMap place_of_reference(const std::string& reference);

}  // namespace ensonify::engine
