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

/// The lists of YOLO's formats, with boxes and with outlines, of the splits that have pictures;
/// classes[k] is class k. On a file system without links, lists are left out, with a warning.
void write_yolo(const PictureIndexes& indexes, const std::vector<std::string>& classes,
                MergedFiles& files, std::vector<std::string>& warnings);

/// hub/GROUP/SPLIT/, as the Hub's ImageFolder reads them: pictures, and metadata.jsonl next to
/// them. The pictures are hard links, or copies on a file system without.
HubGroups write_hub(const PictureIndexes& indexes, const CheckedSamples& samples,
                    MergedFiles& files);

}  // namespace ensonify::engine
