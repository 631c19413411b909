#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// The files that a scene names, and those behind them (files_behind(), whose exceptions it
/// throws).
std::vector<std::filesystem::path> files_read(const Scene& scene);

/// Throws SceneError if a file to write is one of those that are read, also under another name or
/// through a link.
void require_not_read(const std::filesystem::path& output,
                      std::span<const std::filesystem::path> read);
/// The same for all files that a run of the scene would write or replace in a folder.
void require_not_read(const Scene& scene, const std::filesystem::path& folder,
                      std::span<const std::filesystem::path> read);

}  // namespace ensonify::engine
