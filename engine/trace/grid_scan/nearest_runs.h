#pragma once

#include <ensonify/engine/trace/fan_runs.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// The nearer of two lists of runs on each ray of a fan, decided as fan_scan does. The faces of
/// both are faces of these triangles.
void nearest_runs(const RayFan& fan, refine::Triangles triangles, const FanRuns& a,
                  const FanRuns& b, FanRuns& nearest);

}  // namespace ensonify::engine
