#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/dataset/distribution.h>
#include <ensonify/engine/dataset/recipe_reader.h>

namespace ensonify::engine {

/// A recipe's text, and which of its keys are drawn how often.
struct DrawnKeys : RecipeText {
  std::set<std::string, std::less<>> of_seafloor;  ///< keys that are drawn once per seafloor
  std::size_t renders = 1;                         ///< per sample
};

/// Selects the random numbers of a key.
std::uint64_t key_number(std::string_view key);
/// A number in (0, 1] for each index of a sequence, which the stream seeds.
double stratified(const RandomStream& stream, std::uint64_t index);

/// The values of one sample's keys. A draw depends only on the recipe's seed, the key's name and
/// the number of the sample, or of its seafloor.
class SampleDraws {
 public:
  /// `text` must outlive it.
  SampleDraws(const DrawnKeys& text, std::size_t sample, std::size_t seafloor, std::size_t render)
      : text_(text), sample_(sample), seafloor_(seafloor), render_(render) {}

  /// A key's value as in TOML; empty: left out. Throws SceneError for a key without a value, for
  /// one that depends on itself, and for more than `most_levels` keys in a chain; `asked_by` is the
  /// place for messages.
  const std::string& value(const std::string& key, const std::string& asked_by);

 private:
  double number(const std::string& key, const Distribution& d);
  std::string draw(const std::string& stream_name, const Distribution& d, const std::string& key);
  std::string adjusted(std::string drawn, const Distribution& d);

  const DrawnKeys& text_;
  std::size_t sample_, seafloor_, render_;
  std::map<std::string, std::optional<std::string>> known_;  // none: being drawn
  int open_ = 0;                                             // keys that are being drawn
};

}  // namespace ensonify::engine
