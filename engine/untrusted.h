#pragma once

#include <filesystem>
#include <string_view>

namespace ensonify::engine {

// Checks of what files and requests from others say.

/// Whether a path stays inside the folder that it is relative to.
bool stays_inside(const std::filesystem::path& path);

/// Throws std::invalid_argument for JSON with lists or objects more than 64 levels deep. To copy or
/// write such JSON takes stack for each level.
void require_shallow_json(std::string_view json);

}  // namespace ensonify::engine
