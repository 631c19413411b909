#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
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

/// The content of a dataset's card.
struct Card {
  std::string title, recipe, version;
  std::size_t samples = 0, seafloors = 0;
  std::vector<std::string> classes, sediments, licences, assets;
  std::map<std::string, std::size_t> samples_by_split, images;
  /// Targets in whole lines, by class, then split.
  std::map<std::string, std::map<std::string, std::size_t>> targets;
  std::map<std::string, Realised> drawn;     ///< by key of the recipe
  std::map<std::string, Realised> measured;  ///< of the targets in whole lines, by JSON key

  std::string markdown() const;
};

}  // namespace ensonify::engine
