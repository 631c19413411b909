#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>

#include <ensonify/engine/base/memory.h>
#include <ensonify/engine/dataset/recipe.h>
#include <ensonify/engine/image/display.h>

namespace ensonify::engine {

struct PreviewControl {
  int threads = 0;
  std::filesystem::path cache = {};    ///< for analysed seafloors
  MemoryLimit memory = {};             ///< shared by the samples that are made at the same time
  std::filesystem::path scratch = {};  ///< a folder for the runs' files, which are removed again
  std::function<bool(std::size_t done, std::size_t of)> progress = {};  ///< as in GenerateControl
};

/// A contact sheet, and how many samples it shows.
struct ContactSheet {
  Picture picture;
  std::size_t samples = 0;
};

/// A contact sheet of `samples` of a recipe's samples, evenly chosen. For each: the line of its
/// first sonar next to the line's labels, to scale, with boxes around the targets and their
/// classes, and the drawn values below. If `progress` stops it, the sheet has the samples that were
/// finished; without any, Stopped is thrown. Throws as Recipe::sample() and run().
ContactSheet preview(const Recipe& recipe, std::size_t samples, const PreviewControl& control);

}  // namespace ensonify::engine
