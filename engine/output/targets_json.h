#pragma once

#include <span>
#include <string>

#include <ensonify/engine/image/truth.h>
#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/sonar/echo/object_visibility.h>

namespace ensonify::engine {

/// What the picture of a waterfall shows of the seafloor's objects and features, as JSON: each
/// target's labels, place and size; an object's heading (degrees), burial and visible share (none
/// where no views were taken), a feature's layer; its range, side, ping and aspect (the direction
/// of sight less the heading, degrees clockwise); box [column, row, columns, rows], area and
/// polygons [column, row, ...] of its body and of its shadow in pixels of NAME.png, and where these
/// have holes all their pixels as `rle`, COCO's run lengths; contrast in dB. What shows nothing is
/// left out.
std::string targets_json(std::span<const Target> targets, const Waterfall& waterfall,
                         const Seafloor& seafloor, std::span<const ObjectView> views = {});

}  // namespace ensonify::engine
