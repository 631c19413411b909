#pragma once

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// Checks a scene that was not made by a reader: each value must be in the range of its key, and
/// options must fit each other. Throws SceneError, which names the key.
void check_values(const Scene& scene);

}  // namespace ensonify::engine
