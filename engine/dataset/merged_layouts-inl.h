#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include <ensonify/engine/dataset/card.h>
#include <ensonify/engine/dataset/checked_samples-inl.h>
#include <ensonify/engine/dataset/merged_files.h>
#include <ensonify/engine/dataset/picture_index-inl.h>

namespace ensonify::engine {

/// The pictures of a dataset by group and split.
using PictureIndexes = std::map<std::pair<std::string, std::string>, PictureIndex>;

/// Writes yolo/ (boxes) and yolo_segment/ (outlines) for the splits that have pictures. classes[k]
/// is class k. On a file system without links, leaves out the lists and adds a warning.
void write_yolo(const PictureIndexes& indexes, const std::vector<std::string>& classes,
                MergedFiles& files, std::vector<std::string>& warnings);

/// Writes hub/GROUP/SPLIT/ for the Hub's ImageFolder: pictures, and metadata.jsonl next to them.
/// The pictures are hard links, or copies on a file system without hard links.
HubGroups write_hub(const PictureIndexes& indexes, const CheckedSamples& samples,
                    MergedFiles& files);

}  // namespace ensonify::engine
