#pragma once

#include <functional>
#include <string>
#include <string_view>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// Checks that the options of a scene fit each other; the range of each key is not checked here.
/// Throws SceneError; its message begins with the place of the wrong key, which `place` returns.
void check_scene(const Scene& scene, const std::function<std::string(std::string_view key)>& place);

/// Throws SceneError, whose message begins with `place`, if the images of this number of pings
/// would be too large.
void check_pings(const Scene& scene, double pings, std::string_view place);

}  // namespace ensonify::engine
