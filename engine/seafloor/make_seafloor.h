#pragma once

#include <cstdint>
#include <span>

#include <ensonify/engine/memory.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/material.h>
#include <ensonify/engine/seafloor/objects/object_options.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/seafloor/seafloor_options.h>

namespace ensonify::engine {

/// What a seafloor's maker may take of memory, and what will be made of its mesh.
///
/// All estimates here and where this is filled in count what is certainly allocated at one time, so
/// that nothing is refused that fits: of a survey, whose holes make no faces, the heights before it
/// is read and the faces once they are known; of random layers what each of them takes.
struct MemoryPlan {
  MemoryLimit limit;
  double bytes_per_face = 0.0;  ///< of what is built over the mesh: a tree, or the analysis
  double more_bytes = 0.0;      ///< of what is there at the same time, as a run's images
};

/// Reads the header of a survey grid, and no more. Throws as make_seafloor() does where that is
/// enough to refuse it.
void check_header(const SeafloorOptions& options);

/// The heights that options describe. Throws std::invalid_argument for options that make no bed
/// below the sea surface, or are a mesh's, which has no grid of heights; refine::MeshError for a
/// survey that makes none, and what its parts throw; MemoryError, before memory is allocated, for
/// heights that do not fit.
Heightfield make_heightfield(const SeafloorOptions& options, std::uint64_t seed,
                             const MemoryPlan& plan = {});

/// The bed (of any kind) as a mesh, with objects set down on it; `materials` are the scene's own.
/// Throws as make_heightfield does, and refine::MeshError for a mesh that cannot be read or an
/// object without a bed below, and std::invalid_argument for objects over a progressive mesh, which
/// has its own.
Seafloor make_seafloor(const SeafloorOptions& options, std::uint64_t seed,
                       std::span<const ObjectOptions> objects = {},
                       std::span<const Material> materials = {}, const MemoryPlan& plan = {});

}  // namespace ensonify::engine
