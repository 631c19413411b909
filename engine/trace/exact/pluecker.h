#pragma once

#include <memory>

#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {

/// The reference: the paper's test of a ray against a face's edges in Plücker coordinates. It
/// computes in double, and exactly where rounding could decide. Its tree changes no answer
/// (pluecker_faces.h, box_tree.h). No ray slips through an edge or a vertex, and a ray that enters
/// through an edge or a vertex hits exactly one of the faces around it. The tie rule of
/// exact_side.h decides which, not the lowest number. Takes up to 715 million faces, and about
/// 150 bytes for each, 180 while it is built.
std::unique_ptr<Intersector> make_pluecker(const IntersectorOptions& options);

/// The same test for every face and every ray, without a tree: slow, with the same bits.
std::unique_ptr<Intersector> make_brute_force(const IntersectorOptions& options);

}  // namespace ensonify::engine
