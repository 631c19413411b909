#pragma once

#include <filesystem>

#include <ensonify/engine/dataset/recipe.h>
#include <ensonify/engine/run.h>

namespace ensonify::engine {

/// Writes into a sample's folder what the dataset has in addition to the run's own files: labels of
/// the whole lines, more displays, ground range, tiles, chips. An image STEM.png has
/// STEM.class.png, .sediment.png, .instance.png, .region.png, STEM.json and STEM.txt (YOLO);
/// further displays are STEM.r1.png with STEM.r1.txt and so on. The lines' labels have the numbers
/// of the scene's output.class_names and sediment_names. Returns the seconds that writing to the
/// disk took. Throws std::invalid_argument for tiles or chips larger than a line, and for labels
/// that are not among these names; std::system_error.
double write_products(const DatasetOptions& options, const SampleScene& sample,
                      const RunOutputs& outputs, const std::filesystem::path& folder);

}  // namespace ensonify::engine
