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

/// Changes the bed around objects at their final places as their tables define: a moat, half as
/// deep in the lee, and a tail behind each object. No moat digs under an object that stands on the
/// bed, so it still stands there; height_m > 0 lets an object hang in the water. Depths are shares
/// of the object's height over the bed, which is the median height of its top. The moat is deepest
/// at a distance of half this height from the object, or farther if its wall would be too steep for
/// sand. The tail is six times as long as the height. Moat and tail change along the object at
/// random.
void add_scours(Heightfield& bed, const PlacedObjects& placed,
                std::span<const ObjectOptions> tables, std::uint64_t seed,
                const WorkControl& control);

}  // namespace ensonify::engine
