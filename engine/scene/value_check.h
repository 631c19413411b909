#pragma once

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// For scenes that no reader made: that each value is one that its key may have, and that options
/// fit each other. Throws SceneError that names the key.
void check_values(const Scene& scene);

}  // namespace ensonify::engine
