#pragma once

#include <string>
#include <utility>

#include <ensonify/refine/error.h>

namespace ensonify::engine {

/// An error in a scene, with the message `file:line:column: what is wrong, what was expected, what
/// to do`.
struct SceneError : Error {
  using Error::Error;
  /// `at`: the key of the wrong value, or of its table, such as objects.0 or seafloor.pits.1.
  SceneError(std::string at, const std::string& what) : Error(what), key(std::move(at)) {}

  std::string key;  ///< empty: unknown
};

}  // namespace ensonify::engine
