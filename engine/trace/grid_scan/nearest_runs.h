#pragma once

#include <ensonify/engine/trace/fan_runs.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// Merges two lists of runs of a fan: each ray gets the nearer face, decided as in fan_scan. The
/// faces of both lists are faces of these triangles.
void nearest_runs(const RayFan& fan, refine::Triangles triangles, const FanRuns& a,
                  const FanRuns& b, FanRuns& nearest);

}  // namespace ensonify::engine
