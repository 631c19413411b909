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
  std::filesystem::path scratch = {};  ///< a folder for the runs' files, which are removed later
  std::function<bool(std::size_t done, std::size_t of)> progress = {};  ///< as in GenerateControl
};

/// A contact sheet (one picture of many samples), and the number of samples in it.
struct ContactSheet {
  Picture picture;
  std::size_t samples = 0;
};

/// A contact sheet of `samples` samples of a recipe, evenly chosen. For each sample it shows the
/// line of the first sonar next to the line's labels, to scale, with boxes around the objects; and
/// the drawn values below. If `progress` stops the work, the sheet has the finished samples;
/// Stopped is thrown if there are none. Throws as Recipe::sample() and run().
ContactSheet preview(const Recipe& recipe, std::size_t samples, const PreviewControl& control);

}  // namespace ensonify::engine
