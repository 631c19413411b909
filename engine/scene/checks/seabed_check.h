#pragma once

#include <functional>
#include <string>
#include <string_view>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// Checks that a material is known and scatters at each sonar's frequency. Throws SceneError,
/// beginning with the place of the key that names it, which `place` returns.
void check_material(const Scene& scene, std::string_view material, const std::string& key,
                    const std::function<std::string(std::string_view key)>& place);

/// Checks that patches and layers of relief fit the seabed. Throws SceneError, beginning with the
/// place of the key at fault, which `place` returns.
void check_seabed(const Scene& scene,
                  const std::function<std::string(std::string_view key)>& place);

/// Checks the files that patches and layers name, once their paths are known: that images and
/// outlines can be read, and that those of a generated seabed lie on it.
void check_seabed_files(const Scene& scene,
                        const std::function<std::string(std::string_view key)>& place);

}  // namespace ensonify::engine
