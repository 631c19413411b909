#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace ensonify::engine {

/// The values of one quantity over a dataset: numbers or words.
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

/// The pictures of hub/: the splits of each group, as folders, and whether a split has targets.
using HubGroups = std::map<std::string, std::map<std::string, bool>>;

/// The content of a dataset's card.
struct Card {
  std::string title, recipe, version;
  std::string licence, creator, url, published;  ///< as in DatasetOptions
  std::size_t samples = 0, seafloors = 0;
  std::vector<std::string> overrides;  ///< of the recipe, on the command line
  std::vector<std::string> classes, sediments, licences, assets;
  std::map<std::string, std::size_t> samples_by_split, images;
  HubGroups hub;
  std::vector<std::string> pictures;  ///< paths in the dataset's folder
  /// The number of targets in whole lines, by class, then by split.
  std::map<std::string, std::map<std::string, std::size_t>> targets;
  std::map<std::string, Realised> drawn;     ///< by key of the recipe
  std::map<std::string, Realised> measured;  ///< of the targets in whole lines, by JSON key

  std::string heading() const;      ///< the dataset's title, or a general one
  std::string description() const;  ///< in a sentence
  /// README.md, with the metadata of the Hugging Face Hub in front (YAML, its dataset cards).
  std::string markdown() const;
};

}  // namespace ensonify::engine
