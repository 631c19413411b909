#pragma once

#include <cstdint>
#include <span>

#include <ensonify/engine/base/work_control.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/bed_height.h>
#include <ensonify/engine/seafloor/material.h>
#include <ensonify/engine/seafloor/memory_plan.h>
#include <ensonify/engine/seafloor/objects/object_options.h>
#include <ensonify/engine/seafloor/seafloor.h>

namespace ensonify::engine {

/// Sets objects down on a seafloor that has none. `heights`, if not null, are the heights of the
/// seafloor's grid. If objects have scours, the scours are added to `heights`, and the grid is made
/// again from them. Throws what place_objects() throws;
/// SceneError for scours without heights; std::invalid_argument for more objects than there are
/// labels; refine::MeshError for more than 2^31 faces.
void add_objects(std::span<const ObjectOptions> tables, std::uint64_t seed,
                 std::span<const Material> materials, Heightfield* heights, Seafloor& seafloor,
                 const MemoryPlan& plan, const WorkControl& control);

/// Adds the objects that move to Seafloor::moving, where each begins on or over the bed, and their
/// classes and materials. Throws what place_objects() and read_way() throw.
void add_moving_objects(std::span<const ObjectOptions> tables, std::uint64_t seed,
                        std::span<const Material> materials, const BedGrid& bed, Seafloor& seafloor,
                        const MemoryPlan& plan, const WorkControl& control);

}  // namespace ensonify::engine
