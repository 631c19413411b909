#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

#include "support/paths.h"

namespace ensonify::tests {

/// A file of the real data (in ENSONIFY_DATA, or next to the checkout); none if it is missing: then
/// the test reports that and skips.
inline std::optional<std::filesystem::path> data_file(const std::string& name) {
  const char* folder = std::getenv("ENSONIFY_DATA");
  const std::filesystem::path file =
      (folder && *folder ? std::filesystem::path(folder) : default_data_folder()) / name;
  if (!std::filesystem::is_regular_file(file)) return std::nullopt;
  return file;
}

}  // namespace ensonify::tests
