#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace ensonify::engine {

/// A tar (ustar) in the making, with nothing in it of time or owner; in place once it is finished.
class TarFile {
 public:
  explicit TarFile(const std::filesystem::path& file);
  ~TarFile();
  TarFile(const TarFile&) = delete;
  TarFile& operator=(const TarFile&) = delete;
  /// Throws std::system_error where the disk refuses, std::runtime_error for a name that tar does
  /// not take.
  void add(const std::string& name, std::span<const std::byte> content);
  void finish();

 private:
  struct Open;
  std::unique_ptr<Open> open_;
};

/// Calls f for each member, in order. Throws std::runtime_error, naming the file, for one that is
/// damaged.
void read_tar(
    const std::filesystem::path& file,
    const std::function<void(const std::string& name, std::vector<std::byte> content)>& f);

}  // namespace ensonify::engine
