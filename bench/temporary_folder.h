#pragma once

#include <unistd.h>

#include <filesystem>

#include <fmt/format.h>

namespace ensonify::bench {

/// A new folder. The destructor removes the folder with its contents.
class TemporaryFolder {
 public:
  TemporaryFolder() { std::filesystem::create_directories(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  inline static int made_ = 0;
  std::filesystem::path path_ = std::filesystem::temp_directory_path() /
                                fmt::format("ensonify-bench-{}-{}", ::getpid(), ++made_);
};

}  // namespace ensonify::bench
