#pragma once

#include <functional>
#include <string>
#include <string_view>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// Checks that options fit each other, beyond the range of each key. Throws SceneError, beginning
/// with the place of the key at fault, which `place` returns.
void check_scene(const Scene& scene, const std::function<std::string(std::string_view key)>& place);

/// Throws SceneError, beginning with `place`, if the images of that many pings would be too large.
void check_pings(const Scene& scene, double pings, std::string_view place);

}  // namespace ensonify::engine
