#pragma once

#include <string>

#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/memory_plan.h>
#include <ensonify/engine/seafloor/seafloor_options.h>

namespace ensonify::engine {

/// Where make_seafloor() leaves the faces of a bed of heights. A bed from a mesh stays a mesh.
enum class BedForm {
  mesh,  ///< in a mesh, together with the objects' faces
  grid   ///< in the grid, with about a seventh of the memory
};

/// Advice for a message: how to need less memory for a bed of this form.
std::string smaller_bed_remedy(const SeafloorOptions& options, BedForm form);

/// Throws MemoryError, before anything is made, if the heights cannot fit.
void require_heights_fit(const SeafloorOptions& options, const MemoryPlan& plan);

/// Throws MemoryError, before anything is made, if the bed (of a survey: its heights) cannot fit.
void require_bed_fits(const SeafloorOptions& options, const MemoryPlan& plan, BedForm form);

/// Throws MemoryError if what is made of these heights cannot fit.
void require_faces_fit(const SeafloorOptions& options, const Heightfield& field,
                       const MemoryPlan& plan, BedForm form);

}  // namespace ensonify::engine
