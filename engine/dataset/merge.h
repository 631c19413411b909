#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace ensonify::engine {

/// What a merge found.
struct MergeReport {
  std::size_t samples = 0;           ///< that are there and whole
  std::vector<std::size_t> missing;  ///< and those that are not there
  std::vector<std::string> damaged;  ///< a line each: the file, what is wrong
  std::map<std::string, std::size_t> images, samples_by_split;
  std::vector<std::filesystem::path>
      files;  ///< written; none where something is missing or damaged
  /// What is amiss with a whole dataset's splits: empty ones, classes that one does not show,
  /// seabeds in several.
  std::vector<std::string> warnings;
};

/// Checks every file of a dataset against its sample's hashes and, where all is there, writes
///
///     manifest.jsonl              a line a sample: split, seafloor, seed, draws, files with hashes
///     splits/SPLIT.txt            numbers of samples
///     coco/GEOMETRY_KIND_SPLIT.json   of lines, tiles and chips
///     yolo/GEOMETRY_KIND.yaml, _SPLIT.txt   of samples in folders, with links to these: images,
///     labels README.md                   the dataset's card
///
/// over those of an earlier merge. Throws SceneError for a folder without a dataset.json that can
/// be read, std::system_error where the disk refuses. `progress` returning false stops with
/// Stopped.
MergeReport merge(const std::filesystem::path& folder,
                  const std::function<bool(std::size_t done, std::size_t of)>& progress = {});

}  // namespace ensonify::engine
