#pragma once

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// Sets the options that `scene.conditions` implies. All other options must have their defaults.
/// Conditions::survey sets, as they are at sea, the motion (unless the track is from a file), other
/// paths, the recorder of each sidescan, and the display's gain over range. Conditions::ideal
/// switches texture off. Conditions::by_preset: survey if a sidescan has a preset, else no change.
void use_conditions(Scene& scene);

}  // namespace ensonify::engine
