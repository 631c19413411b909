#pragma once

#include <optional>
#include <string>

#include <ensonify/engine/seafloor/objects/object_options.h>

namespace ensonify::engine {

/// A key and the error in its value.
struct ObjectFault {
  std::string key;
  std::string message;
};

/// The first error in a table of objects, whose key is `name`: keys that contradict each other, or
/// belong to other shapes.
std::optional<ObjectFault> fault_of(const ObjectOptions& object, const std::string& name);

}  // namespace ensonify::engine
