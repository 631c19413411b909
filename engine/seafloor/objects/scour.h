#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <ensonify/engine/base/work_control.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/objects/object_options.h>
#include <ensonify/engine/seafloor/objects/objects.h>

namespace ensonify::engine {

/// The first table whose objects have moats or tails.
std::optional<std::size_t> first_scoured(std::span<const ObjectOptions> tables);

/// Moves the bed around objects at their final places, as their tables ask: a moat, half as deep in
/// the lee, and a tail behind them. A moat leaves what lies under any object, so that all still
/// stand on it, unless the object's own height_m lets it hang in the water.
/// Depths are shares of the object's height over the bed; half of the object is lower than this
/// height. The moat is deepest at a distance of half that height from the object, or farther if its
/// wall would be steeper than sand stands. The tail is six times as long as the height. Both change
/// along the object at random.
void add_scours(Heightfield& bed, const PlacedObjects& placed,
                std::span<const ObjectOptions> tables, std::uint64_t seed,
                const WorkControl& control);

}  // namespace ensonify::engine
