#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/dataset/recipe.h>
#include <ensonify/engine/image/display.h>

namespace ensonify::engine {

struct PreviewControl {
  int threads = 0;
  std::filesystem::path cache = {};
  std::filesystem::path scratch = {};  ///< a folder for the runs' files, which go again
  std::function<bool(std::size_t done, std::size_t of)> progress = {};  ///< as of generate()
};

/// A contact sheet of some of a recipe's samples, evenly chosen: of each its first sonar's line
/// beside its labels, to scale, boxes about the targets with their classes, and what was drawn for
/// it in words. Throws as Recipe::sample and run do, and Stopped.
Picture preview(const Recipe& recipe, std::size_t samples, const PreviewControl& control);

}  // namespace ensonify::engine
