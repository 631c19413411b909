#pragma once

#include <string>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// A commented TOML file with every key, its unit, range and value, that reads back to the same
/// scene; it names files as the scene did.
std::string dump_scene(const Scene& scene, bool with_comments = true);

/// The table of keys as a reference page in Markdown: key, what it is, what is expected, default.
std::string schema_text();

}  // namespace ensonify::engine
