#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include <ensonify/engine/base/work_control.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/material.h>
#include <ensonify/engine/seafloor/objects/object_options.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/seafloor/seafloor_memory.h>
#include <ensonify/engine/seafloor/seafloor_options.h>

namespace ensonify::engine {

/// Part of the keys of caches. Raise it if changed code makes other seafloors from equal options.
inline constexpr int seafloor_version = 23;

/// The heights of the bed that make_seafloor() makes, with the scours of the objects but without
/// the objects. Throws std::invalid_argument if a generated bed rises above the sea surface, or if
/// the options name a mesh, which has no grid of heights; refine::MeshError if the whole survey is
/// above the sea surface; MemoryError, before it allocates, if the heights do not fit; and what the
/// layers throw.
Heightfield make_heightfield(const SeafloorOptions& options, std::uint64_t seed,
                             std::span<const ObjectOptions> objects = {},
                             std::span<const Material> materials = {}, const MemoryPlan& plan = {},
                             const WorkControl& control = {});

/// The bed (of any kind), with objects set down on it; `materials` are the materials that the scene
/// defines. Throws what make_heightfield() throws; refine::MeshError for a mesh that cannot be
/// read; SceneError for objects that cannot be made or set down; std::invalid_argument for objects
/// on a progressive mesh, which already contains its objects.
Seafloor make_seafloor(const SeafloorOptions& options, std::uint64_t seed,
                       std::span<const ObjectOptions> objects = {},
                       std::span<const Material> materials = {}, const MemoryPlan& plan = {},
                       BedForm form = BedForm::mesh, const WorkControl& control = {});

/// Moves a bed that is in a grid into the mesh. Faces and labels keep their numbers. What
/// `stop_check` throws ends the work, and the seafloor is then unchanged.
void take_bed_to_mesh(Seafloor& seafloor, const std::function<void()>& stop_check = {});

}  // namespace ensonify::engine
