#pragma once

#include <string>
#include <vector>

#include <ensonify/engine/dataset/recipe.h>

namespace ensonify::engine {

/// The content of dataset.json: the recipe's text, versions, names of the labels, assets with their
/// hashes.
std::string dataset_json(const Recipe& recipe);

/// The content of sample.json, the last file written to a sample's folder: the drawn values, and
/// each file of the folder with its hash.
std::string sample_json(std::size_t number, const SampleScene& sample,
                        const std::filesystem::path& folder);

}  // namespace ensonify::engine
