#pragma once

#include <string>

#include <ensonify/engine/dataset/recipe.h>

#include "support/catch.h"

namespace ensonify::tests {

/// A recipe from its text without the version.
inline engine::Recipe recipe_of(const std::string& text) {
  return engine::Recipe("version = 1\n" + text, "r.toml", {});
}

inline void check_refused(const std::string& text, const std::string& message) {
  CAPTURE(text);
  CHECK_THROWS_WITH(recipe_of(text), Catch::Contains(message));
}

}  // namespace ensonify::tests
