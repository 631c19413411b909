#pragma once

#include <optional>
#include <span>
#include <string>

#include <ensonify/engine/seafloor/objects/object_options.h>

namespace ensonify::engine {

/// A wrong key, and a message about it.
struct ObjectFault {
  std::string key;
  std::string message;
};

/// The first error in a table of objects: keys that contradict each other or belong to other
/// shapes. `name` is the table's key, such as objects.0.
std::optional<ObjectFault> fault_of(const ObjectOptions& object, const std::string& name);

/// The first error in the way in which tables of objects make assemblies.
std::optional<ObjectFault> fault_of_assemblies(std::span<const ObjectOptions> objects);

}  // namespace ensonify::engine
