#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <ensonify/engine/dataset/recipe.h>

namespace ensonify::engine {

/// The content of dataset.json: the recipe's text, versions, names of the labels, assets with their
/// hashes, and the hash of all this.
std::string dataset_json(const Recipe& recipe);
/// The hash in the content of dataset.json.
std::string hash_in(const std::string& dataset_json);

/// Throws SceneError, with the first difference, if the file dataset.json of a folder does not have
/// the content that the recipe gives.
void require_same_dataset(const std::filesystem::path& file, const std::string& content);

/// The splits that samples can be in.
std::vector<std::string> splits_of(const SplitOptions& split);

/// The content of sample.json, the last file written to a sample's folder: the dataset that it
/// belongs to (the content of dataset.json), the drawn values, and each file of the folder with its
/// hash.
std::string sample_json(std::size_t number, const SampleScene& sample,
                        const std::string& dataset_json, const std::filesystem::path& folder);

/// Whether a folder has all files that its sample.json lists, with their sizes. (`merge` compares
/// their hashes.) Throws SceneError if it is not the folder of this sample of the dataset, or if
/// listed files are missing and unlisted ones are there: then nothing in it may be removed.
bool is_whole_sample(const std::filesystem::path& folder, std::size_t number,
                     const std::string& dataset_xxh128);

}  // namespace ensonify::engine
