#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/simulate.h>

namespace ensonify::engine {

// For those who change a session by a scene's keys: what these mean to a Simulator.

/// The numbers of the scene's sonars that any of these overrides (`sonar.NAME.key=value`) changes.
std::vector<std::size_t> changed_sonars(const Scene& scene, std::span<const std::string> overrides);

/// The object of a scene that has one, to be put into another scene. Throws std::invalid_argument
/// for another number of tables, and as mesh_of().
MovingObject single_object(const Scene& scene);

}  // namespace ensonify::engine
