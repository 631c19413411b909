#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace ensonify::engine {

/// Writes a tar (ustar) without times or owners. The file has its final name only after finish().
class TarFile {
 public:
  explicit TarFile(const std::filesystem::path& file);
  ~TarFile();
  TarFile(const TarFile&) = delete;
  TarFile& operator=(const TarFile&) = delete;
  /// Throws std::system_error if the file cannot be written, std::runtime_error for a name that
  /// does not fit into a tar header.
  void add(const std::string& name, std::span<const std::byte> content);
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Calls f for each member, in order. Throws std::runtime_error, with the file's name, if the file
/// is damaged.
void read_tar(
    const std::filesystem::path& file,
    const std::function<void(const std::string& name, std::vector<std::byte> content)>& f);

}  // namespace ensonify::engine
