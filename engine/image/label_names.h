#pragma once

#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/image/waterfall.h>

namespace ensonify::engine {

/// Names of an image's classes and sediments; the index is the number in its layers `class` and
/// `sediment`. Index 0 is "none".
struct LabelNames {
  std::vector<std::string> classes, materials;
};

/// Renumbers the labels of images in place: the `wanted` names (without "none") get 1, 2, ... in
/// their order; the images' other names follow in their old order. Returns the names by their new
/// numbers.
LabelNames renumber(const LabelNames& own, const LabelNames& wanted, std::span<Waterfall> images);

}  // namespace ensonify::engine
