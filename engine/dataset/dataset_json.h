#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <ensonify/engine/dataset/recipe.h>

namespace ensonify::engine {

/// The content of dataset.json: the recipe's text, versions, names of the labels, assets with their
/// hashes, and the hash of all these.
std::string dataset_json(const Recipe& recipe);
/// The hash in the content of dataset.json.
std::string hash_in(const std::string& dataset_json);

/// Throws SceneError, with the first difference, if `file` (dataset.json) has another content.
void require_same_dataset(const std::filesystem::path& file, const std::string& content);

/// The splits that samples can be in.
std::vector<std::string> splits_of(const SplitOptions& split);

/// The content of sample.json, the last file that is written to a sample's folder: the hash in
/// `dataset_json` (the content of dataset.json), the drawn values, and its files with hashes.
std::string sample_json(std::size_t number, const SampleScene& sample,
                        const std::string& dataset_json, const std::filesystem::path& folder);

/// Whether a folder has all files that its sample.json lists, with their sizes. (`merge` compares
/// the hashes.) Throws SceneError if the folder is not of this sample of the dataset, or if listed
/// files are missing while unlisted files are there. In both cases nothing in it may be removed.
bool is_whole_sample(const std::filesystem::path& folder, std::size_t number,
                     const std::string& dataset_xxh128);

}  // namespace ensonify::engine
