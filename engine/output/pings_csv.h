#pragma once

#include <string>

#include <ensonify/engine/image/waterfall.h>

namespace ensonify::engine {

/// One row per ping: ping,t_s,x_m,y_m,z_m,roll_deg,pitch_deg,heading_deg of the vehicle, the same
/// six as the vehicle reports them, altitude_m (empty over a hole), the first bin with an echo on
/// each side (empty: none, or no such side), block, starved bins of each side, artefacts.
std::string pings_csv(const Waterfall& waterfall);

}  // namespace ensonify::engine
