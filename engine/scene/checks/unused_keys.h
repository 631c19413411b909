#pragma once

#include <string>
#include <vector>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// A warning for each key that the scene gives and that has no effect, because another key is not
/// given or switches it off: "file:line:column: 'KEY' has no effect ...". An option that a preset
/// or the scene's conditions switch on counts as switched on. Keys that a scene cannot use at all
/// are errors, not warnings (check_scene()).
std::vector<std::string> unused_keys(const Scene& scene);

}  // namespace ensonify::engine
