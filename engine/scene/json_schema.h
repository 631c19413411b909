#pragma once

#include <string>

namespace ensonify::engine {

/// The keys of a scene, or of a dataset's recipe, as a JSON Schema (draft 7). With it, editors
/// complete and check TOML files. It has the type, range and words of each key, but not the
/// conditions between keys.
std::string json_schema(bool recipe);

}  // namespace ensonify::engine
