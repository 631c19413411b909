#pragma once

#include <filesystem>
#include <string>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// Throws refine::MeshError with the file's name and `what` is wrong with the file.
[[noreturn]] inline void refuse_file(const std::filesystem::path& file, const std::string& what) {
  throw refine::MeshError(file.string() + ": " + what);
}

}  // namespace ensonify::engine
