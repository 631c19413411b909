#pragma once

#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/scatter/sound_speed_profile.h>

namespace ensonify::engine {

/// How far the bent rays of a fan may leave their straight lines: bounds that every ray keeps. For
/// faces no deeper than deepest_m, and rays as long as range_m in travel time at reference_mps.
FanBend bend_of(const scatter::SoundSpeedProfile& profile, double deepest_m, double range_m,
                double reference_mps);

}  // namespace ensonify::engine
