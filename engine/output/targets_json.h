#pragma once

#include <span>
#include <string>

#include <ensonify/engine/image/truth.h>
#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/sonar/echo/object_visibility.h>

namespace ensonify::engine {

/// The objects and features that a waterfall's picture shows, as JSON. For each target: labels,
/// position and size; an object's heading (degrees), burial and visible fraction (null without
/// views), or a feature's layer; range, side, ping and aspect (direction of sight minus heading,
/// degrees clockwise); contrast in dB; of its body and of its shadow: box [column, row, columns,
/// rows], area and polygons [column, row, ...] in pixels of NAME.png, and `rle` (COCO's run lengths
/// of all pixels) where the polygons have holes. Objects that are not in the picture are left out.
std::string targets_json(std::span<const Target> targets, const Waterfall& waterfall,
                         const Seafloor& seafloor, std::span<const ObjectView> views = {});

}  // namespace ensonify::engine
