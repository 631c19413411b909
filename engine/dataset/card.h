#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace ensonify::engine {

/// All values of one quantity in a dataset: numbers or words.
class Realised {
 public:
  void add(double number) { numbers_.push_back(number); }
  void add(const std::string& word) { ++words_[word]; }
  /// Lines of Markdown: a histogram of ten bins, or one line per word.
  std::string text() const;

 private:
  std::vector<double> numbers_;
  std::map<std::string, std::size_t> words_;
};

/// The folders of hub/: by group and split, whether the pictures have targets.
using HubGroups = std::map<std::string, std::map<std::string, bool>>;

/// The content of a dataset's card.
struct Card {
  std::string title, recipe, version;
  std::string licence, creator, url, published;  ///< as in DatasetOptions
  std::size_t samples = 0, seafloors = 0;
  std::vector<std::string> overrides;  ///< of the recipe's keys, by the command line
  std::vector<std::string> classes, sediments, licences, assets;
  std::map<std::string, std::size_t> samples_by_split, images;
  HubGroups hub;
  std::vector<std::string> pictures;  ///< paths in the dataset's folder
  /// The number of targets in whole lines and in frames, by class, then by split.
  std::map<std::string, std::map<std::string, std::size_t>> targets;
  std::map<std::string, Realised> drawn;     ///< by key of the recipe
  std::map<std::string, Realised> measured;  ///< by JSON key: values of these targets

  std::string sonars() const;       ///< which kinds of sonar the pictures are of
  std::string heading() const;      ///< the dataset's title, or a general one
  std::string description() const;  ///< one sentence
  /// The content of README.md. It begins with the YAML that the Hugging Face Hub reads.
  std::string markdown() const;
};

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
