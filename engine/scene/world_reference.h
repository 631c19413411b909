#pragma once

#include <optional>
#include <string>

#include <Eigen/Core>

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/seafloor/bed/geographic.h>

namespace ensonify::engine {

/// The place of the seabed's middle that the track options give; none if they give none.
std::optional<GeographicPlace> given_origin(const TrackOptions& track);

/// The coordinate reference system of a scene's world as WKT: that of the bed; otherwise a local
/// system about the place of the seabed's middle; empty if neither is known.
std::string world_reference(const std::string& of_bed, const Eigen::Vector3d& world_origin,
                            const std::optional<GeographicPlace>& middle);

}  // namespace ensonify::engine
