#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "support/files.h"
#include "support/program.h"

namespace ensonify::tests {

/// Every file under a folder, by its path in the folder.
inline std::map<std::string, std::string> tree_of(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      files[entry.path().lexically_relative(folder)] = read_text(entry.path());
  return files;
}

/// The first path in which two trees differ; empty if they are equal.
inline std::string difference(const std::map<std::string, std::string>& a,
                              const std::map<std::string, std::string>& b) {
  for (const auto& [name, content] : a)
    if (!b.contains(name) || b.at(name) != content) return name;
  for (const auto& [name, content] : b)
    if (!a.contains(name)) return name;
  return "";
}

}  // namespace ensonify::tests
