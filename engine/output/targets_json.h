#pragma once

#include <span>
#include <string>

#include <ensonify/engine/image/truth.h>
#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/seafloor/seafloor.h>

namespace ensonify::engine {

/// What the picture of a waterfall shows of the seafloor's objects, as JSON: each target's labels, place,
/// size, heading (degrees) and burial; its range, side, ping and aspect (the direction of sight less the
/// heading, degrees clockwise); box [column, row, columns, rows], area and polygons [column, row, ...] of
/// its body and of its shadow in pixels of NAME.png; contrast in dB. Objects that show nothing are left
/// out.
std::string targets_json(std::span<const Target> targets, const Waterfall& waterfall,
                         const Seafloor& seafloor);

}  // namespace ensonify::engine
