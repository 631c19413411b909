#pragma once

#include <optional>
#include <string>

#include <ensonify/engine/seafloor/objects/object_options.h>

namespace ensonify::engine {

/// A key, and what is wrong with its value.
struct ObjectFault {
  std::string key;
  std::string message;
};

/// The first thing that is wrong with a table of objects, called `name`: keys that contradict one
/// another, or are for other shapes.
std::optional<ObjectFault> fault_of(const ObjectOptions& object, const std::string& name);

}  // namespace ensonify::engine
