#pragma once

#include <memory>

#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {

/// Tests every face for every ray, in double: the plainest answer, for others to be checked against.
/// Faces that share an edge decide its side by the same product, so no ray slips between them; of
/// several hits at one distance the lowest face wins.
std::unique_ptr<Intersector> make_brute_force(refine::Triangles triangles);

}  // namespace ensonify::engine
