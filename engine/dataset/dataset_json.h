#pragma once

#include <cstddef>
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

/// The files of a dataset's samples.
///
///     samples/000003          a finished sample; it appears complete, in one step
///     samples/.000003.0.tmp   the same while it is made
///     samples/.000003.lock    locked (flock) by the process that makes it, until it ends
///     tars/000001.tar         samples M to 2M-1, instead of their folders (M: samples per tar)
class SampleFolders {
 public:
  SampleFolders(std::filesystem::path dataset, std::size_t samples_per_tar);

  bool finished(std::size_t number) const;  ///< as a folder or in its tar
  std::filesystem::path sample(std::size_t number) const;
  std::filesystem::path tar(std::size_t number) const;
  const std::filesystem::path& dataset() const { return dataset_; }

  static std::string name_of(std::size_t sample);  ///< 000003
  /// The name of a sample's file in a tar: `000003.scene.toml`. For a file in a subfolder it is
  /// `000003-tiles-NAME_0000.png`, so that WebDataset reads an image and its labels as one record.
  static std::string name_in_tar(std::size_t sample, const std::string& file);

 private:
  std::filesystem::path dataset_;
  std::size_t samples_per_tar_;
};

}  // namespace ensonify::engine
