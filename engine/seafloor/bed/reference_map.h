#pragma once

#include <functional>
#include <optional>
#include <string>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/bed/geographic.h>

namespace ensonify::engine {

using PlaceOfMap = std::function<PlaceOnEarth(const Eigen::Vector2d& place)>;

/// A function from metres east and north in a coordinate reference system (WKT) to places on WGS
/// 84. It is empty if the text is empty, or if PROJ cannot convert the system to WGS 84. Only one
/// thread at a time may call it. The function throws std::invalid_argument for a place off the
/// system's map, and in a build without GeographicLib.
PlaceOfMap place_of_reference(const std::string& reference);
using MapOfPlace = std::function<MapPlace(const GeographicPlace& where)>;
/// The inverse of place_of_reference().
MapOfPlace map_of_reference(const std::string& reference);

/// Whether a place lies on the map of a system; true if PROJ cannot convert the system to WGS 84.
bool is_on_map(const std::string& reference, const Eigen::Vector2d& place);

/// Metres on Earth per metre of the system at a place, along the system's north, within 1 %. In a
/// Mercator map it is below 1 away from the equator. Unset if the place or the system cannot be
/// converted to WGS 84.
std::optional<double> scale_of_reference(const std::string& reference,
                                         const Eigen::Vector2d& place);

}  // namespace ensonify::engine
