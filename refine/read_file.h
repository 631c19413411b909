#pragma once

#include <filesystem>
#include <string>

namespace ensonify::refine {

/// The content of a file. Throws std::system_error with its name.
std::string read_file(const std::filesystem::path& file);

}  // namespace ensonify::refine
