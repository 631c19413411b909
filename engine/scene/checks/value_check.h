#pragma once

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// Checks a scene that was made without a reader: that each value is in the range of its key, and
/// that options fit each other. Throws SceneError, which names the key.
void check_values(const Scene& scene);

}  // namespace ensonify::engine
