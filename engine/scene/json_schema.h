#pragma once

#include <string>

namespace ensonify::engine {

/// The keys of a scene, or of a dataset's recipe, as a JSON Schema (draft 7), with which editors
/// complete and check TOML files. It has each key's type, range and words, but not how keys fit
/// each other.
std::string json_schema(bool recipe);

}  // namespace ensonify::engine
