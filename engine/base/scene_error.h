#pragma once

#include <string>
#include <utility>

#include <ensonify/refine/error.h>

namespace ensonify::engine {

/// An error in a scene. The message is `file:line:column: what is wrong, what was expected, what to
/// do`.
struct SceneError : Error {
  using Error::Error;
  /// `at` is the key of the wrong value, or of a table that contains it, such as objects.0 or
  /// seafloor.pits.1.
  SceneError(std::string at, const std::string& what) : Error(what), key(std::move(at)) {}

  std::string key;  ///< empty: unknown
};

}  // namespace ensonify::engine
