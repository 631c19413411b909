#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

#include "support/paths.h"

namespace ensonify::tests {

/// A file of the real data (ENSONIFY_DATA, or beside the checkout); none where it is missing, and
/// the test then says so and skips.
inline std::optional<std::filesystem::path> data_file(const std::string& name) {
  const char* folder = std::getenv("ENSONIFY_DATA");
  const std::filesystem::path file =
      (folder && *folder ? std::filesystem::path(folder) : default_data_folder()) / name;
  if (!std::filesystem::is_regular_file(file)) return std::nullopt;
  return file;
}

}  // namespace ensonify::tests
