#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// The files that a scene names, and those behind each. Throws as files_behind().
std::vector<std::filesystem::path> files_read(const Scene& scene);

/// Throws SceneError if the file `output`, which is to be written, is one of the files in `read`,
/// also if its name is another one or a link.
void require_not_read(const std::filesystem::path& output,
                      std::span<const std::filesystem::path> read);
/// Checks in this way every file that a run of the scene would write or replace in `folder`.
void require_not_read(const Scene& scene, const std::filesystem::path& folder,
                      std::span<const std::filesystem::path> read);

}  // namespace ensonify::engine
