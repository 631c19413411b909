#pragma once

#include <string>
#include <utility>

#include <ensonify/refine/error.h>

namespace ensonify::engine {

/// An error in a scene: `file:line:column: what is wrong, what was expected, what to do`.
struct SceneError : Error {
  using Error::Error;
  /// `at` is the key of the wrong value, or of a table that has it: objects.0, seafloor.pits.1.
  SceneError(std::string at, const std::string& what) : Error(what), key(std::move(at)) {}

  std::string key;  ///< empty: none is known
};

}  // namespace ensonify::engine
