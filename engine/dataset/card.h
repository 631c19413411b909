#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace ensonify::engine {

/// What came of the draws of one quantity: numbers or words.
class Realised {
 public:
  void add(double number) { numbers_.push_back(number); }
  void add(const std::string& word) { ++words_[word]; }
  /// Lines of Markdown: a histogram of ten bins, or a line a word.
  std::string text() const;

 private:
  std::vector<double> numbers_;
  std::map<std::string, std::size_t> words_;
};

/// What a dataset's card tells.
struct Card {
  std::string title, recipe, version;
  std::size_t samples = 0, seafloors = 0;
  std::vector<std::string> classes, sediments, licences, assets;
  std::map<std::string, std::size_t> samples_by_split, images;
  std::map<std::string, std::map<std::string, std::size_t>>
      targets;                               ///< by class, then split; of whole lines
  std::map<std::string, Realised> drawn;     ///< by key
  std::map<std::string, Realised> measured;  ///< of the targets in whole lines

  std::string markdown() const;
};

}  // namespace ensonify::engine
