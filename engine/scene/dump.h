#pragma once

#include <string>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// A TOML file with every key and its value; with comments, also its unit and range. Reading the
/// file gives the same scene. Files have the names that they have in the scene.
std::string dump_scene(const Scene& scene, bool with_comments = true);

/// A reference page of all keys in Markdown: what each is, what is expected, and its default.
std::string schema_text();

}  // namespace ensonify::engine
