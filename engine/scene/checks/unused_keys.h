#pragma once

#include <string>
#include <vector>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// A warning for each key that the scene gives but that has no effect, because another key is
/// missing or switches it off: "file:line:column: 'KEY' has no effect ...". Options that a preset
/// or the scene's conditions switch on count as switched on. Keys that a scene must not have are
/// errors, not warnings (check_scene()).
std::vector<std::string> unused_keys(const Scene& scene);

}  // namespace ensonify::engine
