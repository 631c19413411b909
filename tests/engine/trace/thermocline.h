#pragma once

#include <ensonify/scatter/sound_speed_profile.h>

namespace ensonify::tests {

/// 30 m/s over 4 m.
inline const scatter::SoundSpeedProfile thermocline(
    {{0, 1520}, {6, 1520}, {10, 1490}, {60, 1490.5}});

}  // namespace ensonify::tests
