#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace ensonify::engine {

/// What a merge found.
struct MergeReport {
  std::size_t samples = 0;           ///< complete and undamaged
  std::vector<std::size_t> missing;  ///< numbers of the samples that are not finished
  std::vector<std::string> damaged;  ///< one line per damage: the file, what is wrong
  std::map<std::string, std::size_t> images, samples_by_split;
  /// Chips about a target that show too little of it for a label.
  std::size_t chips_without_target = 0;
  std::vector<std::filesystem::path> files;  ///< written; empty if a sample is missing or damaged
  /// Faults of a complete dataset: empty splits, classes that a split does not show, seabeds in
  /// several splits, labels of very few pixels, and chips without their target.
  std::vector<std::string> warnings;
};

struct MergeOptions {
  bool webdataset = false;  ///< write tars for WebDataset too
};

// What a merge writes into a dataset's folder. GROUP is a geometry and a kind of picture, such as
// slant_tile.
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

/// Checks every file of a dataset against its sample's hashes. If the dataset is complete, writes
/// the files above, replaces those of an earlier merge, and removes what a killed one left. Throws
/// SceneError for a folder without a readable dataset.json, std::system_error if the disk refuses,
/// Stopped if `progress` returns false. It is called often; each stage counts other things. If it
/// stops the merge while the files are written, each of them is an earlier merge's or complete, and
/// the next merge writes all of them.
MergeReport merge(const std::filesystem::path& folder,
                  const std::function<bool(std::string_view stage, std::size_t done,
                                           std::size_t of)>& progress = {},
                  const MergeOptions& options = {});

}  // namespace ensonify::engine
