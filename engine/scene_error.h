#pragma once

#include <ensonify/refine/error.h>

namespace ensonify::engine {

/// An error in a scene: `file:line:column: what is wrong, what was expected, what to do`.
struct SceneError : Error {
  using Error::Error;
};

}  // namespace ensonify::engine
