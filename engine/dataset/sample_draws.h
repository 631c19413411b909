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

/// A recipe's text, and how often its keys are drawn.
struct DrawnKeys : RecipeText {
  std::set<std::string, std::less<>> of_seafloor;  ///< keys that are drawn once per seafloor
  std::size_t renders = 1;                         ///< per sample
};

/// A number that selects the random stream of a key.
std::uint64_t key_number(std::string_view key);
/// The number in (0, 1] at an index of a stratified_number() sequence, whose seeds come from the
/// stream.
double stratified(const RandomStream& stream, std::uint64_t index);

/// The values of one sample's keys, drawn as described at Recipe.
class SampleDraws {
 public:
  /// `text` must outlive this object.
  SampleDraws(const DrawnKeys& text, std::size_t sample, std::size_t seafloor, std::size_t render)
      : text_(text), sample_(sample), seafloor_(seafloor), render_(render) {}

  /// A key's value as in TOML; empty: the key is left out. Throws SceneError for a key without a
  /// value, for a key that depends on itself, and for more than `most_levels` keys that depend on
  /// each other one after the other. `asked_by` is the place for messages.
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
