#pragma once

#include <memory>

#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {

/// The test of pluecker for every face and every ray, without a tree: slow, with the same bits.
std::unique_ptr<Intersector> make_brute_force(const IntersectorOptions& options);

}  // namespace ensonify::engine
