#pragma once

#include <ensonify/engine/run/output_folder.h>
#include <ensonify/engine/run/run_plan.h>
#include <ensonify/engine/run/run_state.h>

namespace ensonify::engine {

/// Makes a run of one part: all images stay in memory until their files are written. Returns its
/// record. Throws as run().
PartRecord make_one_part(RunState& run, OutputFolder& output, Simulator& simulator,
                         const TrackPings& track, const RunPlan& plan);

}  // namespace ensonify::engine
