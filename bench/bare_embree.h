#pragma once

#include <memory>

#include <ensonify/engine/trace/intersector.h>

namespace ensonify::bench {

/// Makes an intersector to measure the time of Embree alone. It builds the same tree and traces the
/// same packets as the intersector `embree`. It does no checks, decides no ties and leaves `hits`
/// unchanged. It throws std::invalid_argument for lists of rays.
std::unique_ptr<engine::Intersector> make_bare_embree(const engine::IntersectorOptions& options);

}  // namespace ensonify::bench
