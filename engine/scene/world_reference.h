#pragma once

#include <string>

#include <Eigen/Core>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// The coordinate reference system of a scene's world as WKT: the survey's own, or a local one at
/// the track's origin; empty if neither is known. Throws refine::MeshError for a survey that cannot
/// be opened.
std::string world_reference(const Scene& scene, const Eigen::Vector3d& world_origin);

}  // namespace ensonify::engine
