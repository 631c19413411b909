#pragma once

#include <string>

#include <ensonify/engine/image/waterfall.h>

namespace ensonify::engine {

/// A table with one row per ping: ping, t_s; x_m, y_m, z_m, roll_deg, pitch_deg, heading_deg of the
/// vehicle; the same six values as the vehicle reports them; altitude_m (empty over a hole); the
/// first bin with an echo on each side (empty: none, or the sonar lacks the side); block; the
/// number of starved bins on each side; artefacts.
std::string pings_csv(const Waterfall& waterfall);

}  // namespace ensonify::engine
