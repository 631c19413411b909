#pragma once

#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/scatter/sound_speed_profile.h>

namespace ensonify::engine {

/// Bounds on how far the bent rays of a fan leave their straight lines. They hold for faces no
/// deeper than deepest_m, and for rays whose travel time times reference_mps is at most range_m.
FanBend bend_of(const scatter::SoundSpeedProfile& profile, double deepest_m, double range_m,
                double reference_mps);

}  // namespace ensonify::engine
