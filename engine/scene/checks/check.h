#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

class Require;  // require-inl.h

/// Checks that the options of a scene fit each other; the range of each key is not checked here.
/// Throws SceneError; its message begins with the place of the wrong key, which `place` returns.
void check_scene(const Scene& scene, const std::function<std::string(std::string_view key)>& place);

/// Part of check_scene(): checks that a material is defined and scatters at the frequency of each
/// sonar. `key` is the key that names the material.
void check_material(const Scene& scene, std::string_view material, const std::string& key,
                    const Require& require);

/// Part of check_scene(): checks that patches and layers of relief fit the seabed.
void check_seabed(const Scene& scene, const Require& require);

/// Checks the files that patches and layers name, after their paths were found: images and outlines
/// can be read, and over a generated seabed the outlines lie on it. Throws as check_scene().
void check_seabed_files(const Scene& scene,
                        const std::function<std::string(std::string_view key)>& place);

/// Throws SceneError, which begins with `place`, if images of `pings` pings would be too large.
void check_pings(const Scene& scene, double pings, std::string_view place);

/// Checks a scene that was not made by a reader: each value must be in the range of its key, and
/// options must fit each other. Throws SceneError, which names the key.
void check_values(const Scene& scene);

/// A warning for each key that the scene gives but that has no effect, because another key is
/// missing or switches it off: "file:line:column: 'KEY' has no effect ...". Options that a preset
/// or the scene's conditions switch on count as switched on. Keys that a scene must not have are
/// errors, not warnings (check_scene()).
std::vector<std::string> unused_keys(const Scene& scene);

/// Throws SceneError if a sonar of the scene is no sidescan; `what` cannot use others, for example
/// "a dataset".
void require_sidescans(const Scene& scene, std::string_view what);

}  // namespace ensonify::engine
