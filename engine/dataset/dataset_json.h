#pragma once

#include <string>
#include <vector>

#include <ensonify/engine/dataset/recipe.h>

namespace ensonify::engine {

/// What dataset.json says: the recipe as it was read, versions, names of the labels, assets with
/// their hashes.
std::string dataset_json(const Recipe& recipe, const std::filesystem::path& data_folder);

/// The last words of a finished sample, sample.json: what was drawn, and each file of its folder
/// with its hash. `images` of the folder are those with a .json of their own.
std::string sample_json(std::size_t number, const SampleScene& sample,
                        const std::filesystem::path& folder);

}  // namespace ensonify::engine
