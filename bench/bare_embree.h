#pragma once

#include <memory>

#include <ensonify/engine/trace/intersector.h>

namespace ensonify::bench {

/// What Embree alone costs: the same tree and the same packets as the intersector `embree`, but
/// fans only, nothing checked, no ties broken, and no hits handed out.
std::unique_ptr<engine::Intersector> make_bare_embree(const engine::IntersectorOptions& options);

}  // namespace ensonify::bench
