#pragma once

#include <ensonify/engine/trace/fan_runs.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// Of two lists of runs of a fan, what is nearer on each ray, decided as fan_scan does. Both count
/// in these triangles.
void nearest_runs(const RayFan& fan, refine::Triangles triangles, const FanRuns& a,
                  const FanRuns& b, FanRuns& nearest);

}  // namespace ensonify::engine
