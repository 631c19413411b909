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
  std::size_t samples = 0;           ///< complete and undamaged
  std::vector<std::size_t> missing;  ///< numbers of the samples that are not finished
  std::vector<std::string> damaged;  ///< one line per damage: the file, what is wrong
  std::map<std::string, std::size_t> images, samples_by_split;
  std::vector<std::filesystem::path> files;  ///< written; empty if a sample is missing or damaged
  /// Faults of a complete dataset's splits: empty splits, classes that a split does not show,
  /// seabeds in several splits.
  std::vector<std::string> warnings;
};

/// Checks every file of a dataset against its sample's hashes. If the dataset is complete, writes
///
///     manifest.jsonl          one line per sample: split, seafloor, seed, drawn values, file
///     hashes splits/SPLIT.txt        the numbers of the samples coco/GEOMETRY_KIND_SPLIT.json
///     annotations of lines, tiles and chips yolo/GEOMETRY_KIND.yaml, _SPLIT.txt    only without
///     tars yolo/images, yolo/labels               links to samples/ README.md               the
///     dataset's card
///
/// and replaces those of an earlier merge. Throws SceneError for a folder without a readable
/// dataset.json, std::system_error if the disk refuses, Stopped if `progress` returns false.
MergeReport merge(const std::filesystem::path& folder,
                  const std::function<bool(std::size_t done, std::size_t of)>& progress = {});

}  // namespace ensonify::engine
