#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/dataset/distribution.h>

namespace ensonify::engine {

/// What a recipe's text says beside its [dataset].
struct RecipeText {
  std::uint64_t seed = 1;
  bool has_seafloor_seed = false;
  std::map<std::string, Distribution, std::less<>> distributions;  ///< by the key's whole name
  std::map<std::string, std::string, std::less<>>
      values;  ///< of the other keys: numbers, words, truths
  std::map<std::string, std::size_t, std::less<>> lists;  ///< how long each list of tables is
  std::set<std::string> assets;                           ///< strings that begin with data:
};

/// Finds a recipe's distributions. Throws SceneError with `file:line:column` for those that are
/// none.
RecipeText parse_recipe_text(std::string_view text, std::string_view name);

}  // namespace ensonify::engine
