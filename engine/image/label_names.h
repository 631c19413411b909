#pragma once

#include <cstdint>
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

/// "none", then the `wanted` names (without "none") in their order, then the other names of `own`.
std::vector<std::string> joined_names(const std::vector<std::string>& own,
                                      std::span<const std::string> wanted);
/// The number in `to` of each name in `from`. `to` must have all these names. 0 stays 0.
std::vector<std::uint32_t> new_numbers(const std::vector<std::string>& from,
                                       const std::vector<std::string>& to);

/// Renumbers the labels of images in place. The `wanted` names (which do not contain "none") get 1,
/// 2, ... in their order, then the other names of `own`, which are the images' names so far, in
/// their order. Returns the names by their new numbers.
LabelNames renumber(const LabelNames& own, const LabelNames& wanted, std::span<Waterfall> images);

}  // namespace ensonify::engine
