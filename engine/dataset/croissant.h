#pragma once

#include <cstdint>
#include <span>
#include <string>

#include <ensonify/engine/dataset/card.h>

namespace ensonify::engine {

/// A file of a dataset's index.
struct IndexFile {
  std::string name;  ///< its path in the dataset's folder
  std::uint64_t size_bytes = 0;
  std::string sha256;
};

/// The dataset as JSON-LD by Croissant 1.0 (http://mlcommons.org/croissant/1.0): the index files
/// with their hashes, the pictures of each group, the classes. What Croissant requires and the card
/// does not have, such as a licence, is left out.
std::string croissant_json(const Card& card, std::span<const IndexFile> files);

}  // namespace ensonify::engine
