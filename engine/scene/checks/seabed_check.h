#pragma once

#include <functional>
#include <string>
#include <string_view>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

class Require;  // require-inl.h

/// Checks that a material is defined and scatters at the frequency of each sonar. Throws
/// SceneError; its message begins with the place of the key that names the material, which `place`
/// returns.
void check_material(const Scene& scene, std::string_view material, const std::string& key,
                    const Require& require);

/// Checks that patches and layers of relief fit the seabed. Throws SceneError; its message begins
/// with the place of the wrong key, which `place` returns.
void check_seabed(const Scene& scene, const Require& require);

/// Checks the files that patches and layers name, after their paths were found: images and outlines
/// can be read, and over a generated seabed the outlines lie on it. Throws SceneError.
void check_seabed_files(const Scene& scene,
                        const std::function<std::string(std::string_view key)>& place);

}  // namespace ensonify::engine
