#pragma once

#include <filesystem>
#include <string>

namespace ensonify::refine {

/// The name of temporary number n of a file or folder: .NAME.n.tmp
std::string temporary_name(const std::filesystem::path& of, int n);
/// Whether a path has such a name for `of`. (.a.b.0.tmp is a temporary of a.b, not of a.)
bool is_temporary_of(const std::filesystem::path& of, const std::filesystem::path& path);

}  // namespace ensonify::refine
