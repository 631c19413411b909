#pragma once

#include <string>

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/live/line_ring.h>
#include <ensonify/engine/live/live_scene.h>

namespace ensonify::engine {

/// What a line by itself can show of a scene's display.
Display line_display(Display display);

/// The frame that says what the lines after it mean: sonars, names, palettes, the display and the
/// seabed.
Bytes setting_frame(const LiveScene& world, const Display& display, const std::string& name);

}  // namespace ensonify::engine
