#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include <ensonify/engine/dataset/recipe.h>
#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine::app {

/// The files that a command reads for a scene: the scene's own, those that it names, and those
/// behind them (files_behind(), whose exceptions it throws).
std::vector<std::filesystem::path> files_read(const std::filesystem::path& scene_file,
                                              const Scene& scene);
/// The same for all samples of a recipe.
std::vector<std::filesystem::path> files_read(const std::filesystem::path& recipe_file,
                                              const Recipe& recipe);

/// Throws UsageError if a file to write is one that the command reads, also under another name or
/// through a link.
void require_not_read(const std::filesystem::path& output,
                      std::span<const std::filesystem::path> read);

}  // namespace ensonify::engine::app
