#pragma once

#include <optional>
#include <span>
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

/// The first error in how tables of objects make assemblies.
std::optional<ObjectFault> fault_of_assemblies(std::span<const ObjectOptions> objects);

}  // namespace ensonify::engine
