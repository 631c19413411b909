#pragma once

#include <functional>
#include <string>
#include <string_view>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// What no single key can tell: that options fit each other. Throws SceneError, beginning with what
/// `place` says of the key at fault.
void check_scene(const Scene& scene, const std::function<std::string(std::string_view key)>& place);

/// Throws SceneError, beginning with `place`, for so many pings that their images would not fit.
void check_pings(const Scene& scene, double pings, std::string_view place);

}  // namespace ensonify::engine
