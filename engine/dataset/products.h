#pragma once

#include <filesystem>
#include <functional>

#include <ensonify/engine/base/memory.h>
#include <ensonify/engine/dataset/recipe.h>
#include <ensonify/engine/run.h>

namespace ensonify::engine {

/// How products are made.
struct ProductsControl {
  MemoryLimit memory = {};
  std::function<void()> stop_check = {};  ///< called before each file, and now and then between
};

/// Writes to a sample's folder the files that a dataset has in addition to the run's files: labels
/// of the whole lines, further displays, ground range, tiles, chips. An image STEM.png has
/// STEM.class.png, .sediment.png, .instance.png, .region.png, STEM.json and STEM.txt (YOLO);
/// further displays are STEM.r1.png with STEM.r1.txt and so on. The numbers in the lines' labels
/// must be those that the scene's output.class_names and sediment_names give. Returns the seconds
/// that writing to the disk took. Throws std::invalid_argument for tiles or chips larger than a
/// line, and for a class or material without such a number; MemoryError for an image in ground
/// range that does not fit into the memory; std::system_error; and what the stop check throws.
double write_products(const DatasetOptions& options, const SampleScene& sample,
                      const RunOutputs& outputs, const std::filesystem::path& folder,
                      const ProductsControl& control);

}  // namespace ensonify::engine
