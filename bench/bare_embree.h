#pragma once

#include <memory>

#include <ensonify/engine/trace/intersector.h>

namespace ensonify::bench {

/// The cost of Embree alone: the same tree and the same packets as the intersector `embree`, but
/// only fans, no checks, no tie-breaking, and no hits returned.
std::unique_ptr<engine::Intersector> make_bare_embree(const engine::IntersectorOptions& options);

}  // namespace ensonify::bench
