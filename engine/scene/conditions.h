#pragma once

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// Sets the options that `scene.conditions` implies. All others must still have their defaults.
/// Conditions::survey: motion (unless the track is from a file), other paths, the recorder of each
/// sonar and the display's gain over range, as they are at sea. Conditions::ideal: no texture.
/// Conditions::by_preset: survey if a sonar has a preset; otherwise no change.
void use_conditions(Scene& scene);

}  // namespace ensonify::engine
