#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace ensonify::engine {

struct MergeReport {
  std::size_t samples = 0;           ///< complete and undamaged
  std::vector<std::size_t> missing;  ///< numbers of the samples that are not finished
  std::vector<std::string> damaged;  ///< one line per damage: the file, what is wrong
  std::map<std::string, std::size_t> images, samples_by_split;
  /// Chips of a target that show too little of the target for a label.
  std::size_t chips_without_target = 0;
  std::vector<std::filesystem::path> files;  ///< written; empty if a sample is missing or damaged
  /// Faults of a complete dataset: empty splits, classes that no picture of a split shows, seabeds
  /// in several splits, labels with very few pixels, and chips without a label of their target.
  std::vector<std::string> warnings;
};

struct MergeOptions {
  bool webdataset = false;  ///< write tars for WebDataset too
};

// The files that a merge writes into a dataset's folder. GROUP is a geometry and a kind of picture,
// such as slant_tile.
//
//     manifest.jsonl               one line per sample: split, seafloor, seed, drawn values, hashes
//     splits/SPLIT.txt             the numbers of the samples
//     coco/GROUP_SPLIT.json        annotations of lines, tiles and chips
//     README.md, pictures/         the dataset's card, with what the Hugging Face Hub reads
//     croissant.json               the same for other catalogues (Croissant 1.0)
//     webdataset/GROUP_SPLIT-000000.tar    only if asked for
//   and if the dataset is not in tars:
//     yolo/GROUP.yaml, GROUP_SPLIT.txt     with boxes; images/ and labels/ are links to samples/
//     yolo_segment/                        likewise with outlines; labels/ has files
//     hub/GROUP/SPLIT/                     pictures (hard links) and metadata.jsonl

/// Compares every file of a dataset with the hash in its sample.json. If the dataset is complete,
/// writes the files above, replaces those of an earlier merge, and removes what a killed merge
/// left. Throws SceneError for a folder without a readable dataset.json, std::system_error if the
/// disk refuses, Stopped if `progress` returns false. `progress` is called often; `done` and `of`
/// count different things in each stage. If it stops the merge while files are written, each file
/// is complete or still the file of an earlier merge, and the next merge writes all files.
MergeReport merge(const std::filesystem::path& folder,
                  const std::function<bool(std::string_view stage, std::size_t done,
                                           std::size_t of)>& progress = {},
                  const MergeOptions& options = {});

}  // namespace ensonify::engine
