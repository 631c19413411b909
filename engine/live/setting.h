#pragma once

#include <string>

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/live/line_ring.h>
#include <ensonify/engine/live/live_scene.h>

namespace ensonify::engine {

/// The scene's display without what needs more than one line (normalisations, equalisation,
/// smoothing), in slant range and grey.
Display line_display(Display display);

/// A warning that names the display's keys that line_display() switches off and that the page does
/// not apply. Empty if none of them is set.
std::string keys_without_effect(const Display& display);

/// The frame that describes the lines after it: sonars, names, palettes, the display and the
/// seabed. `name` is the scene's name.
Bytes setting_frame(const LiveScene& live, const Display& display, const std::string& name);

}  // namespace ensonify::engine
