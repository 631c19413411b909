#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/dataset/distribution.h>

namespace ensonify::engine {

/// A recipe's text without its [dataset].
struct RecipeText {
  std::uint64_t seed = 1;
  bool has_seafloor_seed = false;
  std::map<std::string, Distribution, std::less<>> distributions;  ///< by the key's whole name
  /// Of the other keys: numbers, words, true and false.
  std::map<std::string, std::string, std::less<>> values;
  std::map<std::string, std::size_t, std::less<>> lists;  ///< length of each list of tables
  std::set<std::string> assets;                           ///< strings that begin with data:
};

/// Finds a recipe's distributions. Throws SceneError with `file:line:column` for a
/// distribution that is not valid.
RecipeText parse_recipe_text(std::string_view text, std::string_view name);

}  // namespace ensonify::engine
