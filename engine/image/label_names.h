#pragma once

#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/image/waterfall.h>

namespace ensonify::engine {

/// Names of what an image shows, by their numbers in its layers `class` and `sediment`; number 0 is
/// "none".
struct LabelNames {
  std::vector<std::string> classes, materials;
};

/// Numbers an image's labels anew: the names that are `wanted` (without "none") have 1, 2, ... in
/// their order, the image's other ones follow in their own. Returns all names by their new numbers.
LabelNames renumber(const LabelNames& own, const LabelNames& wanted, std::span<Waterfall> images);

}  // namespace ensonify::engine
