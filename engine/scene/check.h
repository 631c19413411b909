#pragma once

#include <functional>
#include <string>
#include <string_view>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// What no single key can tell: that options fit each other. Throws SceneError, beginning with what
/// `place` says of the key at fault.
void check_scene(const Scene& scene, const std::function<std::string(std::string_view key)>& place);

}  // namespace ensonify::engine
