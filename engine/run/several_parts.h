#pragma once

#include <ensonify/engine/run/output_folder.h>
#include <ensonify/engine/run/run_plan.h>
#include <ensonify/engine/run/run_state.h>

namespace ensonify::engine {

/// Makes the missing parts of a run in several parts, or of this process's share of them, each in a
/// folder of its own, and completes the run once all are there. Returns the record of the run or of
/// the share. Throws as run().
PartRecord make_several_parts(RunState& run, OutputFolder& output, Simulator& simulator,
                              const TrackPings& track, const RunPlan& plan);

}  // namespace ensonify::engine
