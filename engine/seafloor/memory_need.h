#pragma once

#include <cstdint>
#include <span>

#include <ensonify/engine/memory.h>
#include <ensonify/engine/seafloor/heightfield.h>
#include <ensonify/engine/seafloor/seafloor.h>

namespace ensonify::engine {

/// What a seafloor's maker may take of memory, and what will be made of its mesh.
///
/// All estimates here and where this is filled in count what is certainly allocated at one time, so
/// that nothing is refused that fits: of a survey, whose holes make no faces, the heights before it is
/// read and the faces once they are known; of random layers what each of them takes.
struct MemoryPlan {
  MemoryLimit limit;
  double bytes_a_face = 0.0;  ///< of what is built over the mesh: a tree, or the analysis
  double more_bytes = 0.0;    ///< of what is there at the same time, as a run's images
};

/// Reads the header of a survey grid, and no more. Throws as make_seafloor() does where that is enough
/// to refuse it.
void check_header(const SeafloorOptions& options);

/// The functions of seafloor.h, which also throw MemoryError, before the memory is allocated: the
/// heights by the options or the file's header, the mesh and what follows by its number of faces.
Heightfield make_heightfield(const SeafloorOptions& options, std::uint64_t seed,
                             const MemoryPlan& plan);
Seafloor make_seafloor(const SeafloorOptions& options, std::uint64_t seed,
                       std::span<const ObjectOptions> objects,
                       std::span<const Material> materials, const MemoryPlan& plan);

}  // namespace ensonify::engine
